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
    gear_friction,
    inertia_variation,
    gear_ripple,
    timed_torque,
    friction_drift,
    inductance,
    brush_drop,
    dead_time,
    resistance_temperature,
    supply_droop,
    magnetic_saturation,
    bridge_nonlinearity,
    voltage_dead_zone,
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
    lost_counts,
}
