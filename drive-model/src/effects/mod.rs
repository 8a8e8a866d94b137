//! The effects of the catalogue, a file each.

use crate::Card;

macro_rules! catalogue {
    ($($file:ident,)*) => {
        $(pub mod $file;)*

        /// The built-in effects. The order decides between effects that a log cannot distinguish: the first one is named.
        pub(crate) static BUILT_IN: &[&Card] = &[$(&$file::CARD),*];
    };
}

catalogue! {
    viscous,
    coulomb,
    asymmetric_friction,
    load,
    stribeck,
    presliding,
    quadratic_drag,
    viscous_temperature,
    cogging,
    unbalance,
    torque_ripple,
    cable_spring,
    load_step,
    compliance,
    backlash,
    inductance,
    brush_drop,
    dead_time,
    resistance_temperature,
    supply_droop,
    magnetic_saturation,
    encoder_eccentricity,
    sensor_lag,
    time_skew,
    rate_scale,
    rate_scale_nonlinearity,
    rate_bias,
    rate_bias_temperature,
    rate_g_sensitivity,
    current_offset,
    current_scale,
}
