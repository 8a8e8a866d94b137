//! Random devices under test for the simulated stand, with their true values.
//!
//! What no log contains (crystal, mounting, latitude) is drawn within the assumptions of a session ([`Assumptions`]), so that the coverage
//! of the uncertainties can be tested.

use super::Assumptions;
use hal_sim::peripherals::imu::{GyroElement, ImuSetup};
use hal_sim::plant::Stand;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// Standard gravity, m/s².
const STANDARD_GRAVITY_M_S2: f64 = 9.806_65;

/// Random numbers with a reproducible sequence.
struct Draw(Xoshiro256PlusPlus);

impl Draw {
    /// Uniform from −1 to 1.
    fn side(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// Uniform between two values.
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * 0.5 * (self.side() + 1.0)
    }
}

/// Names of quantities of a calibration and their true values.
pub type Truth = Vec<(&'static str, f64)>;

/// Rate gyro and accelerometer number `seed` on the default stand, with their true values; nonlinearity refers to `full_scale_rad_s`.
pub fn drawn_sensor(seed: u64, assumed: &Assumptions, full_scale_rad_s: f64) -> (ImuSetup, Truth) {
    let mut d = Draw(Xoshiro256PlusPlus::seed_from_u64(seed));
    let side = |d: &mut Draw, size: f64| size * d.side();
    let scale = 1.0 + side(&mut d, 0.02);
    let bias = side(&mut d, 0.02);
    // Nonlinearity of 0.02 … 0.2 % of full scale in both terms, above what noise makes.
    let sign = |d: &mut Draw| if d.side() < 0.0 { -1.0 } else { 1.0 };
    let quadratic = sign(&mut d) * d.between(1e-4, 1e-3) / full_scale_rad_s;
    let cubic = sign(&mut d) * d.between(1e-4, 2e-3) / full_scale_rad_s.powi(2);
    let natural_Hz = d.between(40.0, 80.0);
    let damping = d.between(0.5, 0.9);
    // The stand's time base is the crystal: a fast crystal makes the reference rates too low, so the true scale appears too large.
    let crystal = side(&mut d, assumed.crystal_ppm * 1e-6);
    let misalignment = side(&mut d, assumed.misalignment_deg.to_radians());
    let earth = match assumed.latitude_deg {
        Some(latitude) => super::EARTH_RAD_S * (latitude.to_radians() + side(&mut d, assumed.level_deg.to_radians())).sin(),
        None => side(&mut d, super::EARTH_RAD_S),
    };
    let radius_m = 0.05 + side(&mut d, assumed.radius_error_m);
    let (chi_deg, accel_scale) = (side(&mut d, 5.0), 1.0 + side(&mut d, assumed.scale_percent / 100.0));
    let accel_bias = side(&mut d, 0.3);
    let delay_s = 1e-4 * d.between(0.0, 12.0).floor();
    let g_sensitivity_s_m = side(&mut d, assumed.g_sensitivity_deg_s_g.to_radians()) / STANDARD_GRAVITY_M_S2;
    // The trim of the oscillator is good to half a step of 0.15 %.
    let clock_error = side(&mut d, 7.5e-4);
    let imu = ImuSetup {
        gyro_scale: scale * misalignment.cos(),
        gyro_bias_rad_s: bias,
        earth_rate_rad_s: earth,
        radius_m,
        chi_rad: chi_deg.to_radians(),
        accel_scale,
        accel_bias_m_s2: accel_bias,
        clock_error,
        gyro: GyroElement {
            quadratic_s: quadratic,
            cubic_s2: cubic,
            natural_Hz,
            damping,
            delay_s,
            g_sensitivity_s_m,
            ..GyroElement::default()
        },
        ..ImuSetup::default()
    };
    let fs = full_scale_rad_s;
    // Of the element before its scale: ⅔|c₂|Fs + ⅖|c₃|Fs², relative to the slope at rest.
    let nonlinearity = 100.0 * (2.0 / 3.0 * (quadratic * fs).abs() + 0.4 * (cubic * fs * fs).abs());
    let b = 4.0 * damping * damping - 2.0;
    let truth = vec![
        ("scale", scale * (1.0 + 0.6 * cubic * fs * fs) * (1.0 + crystal)),
        ("bias_rad_s", if assumed.latitude_deg.is_some() { bias } else { bias + scale * earth }),
        ("nonlinearity_percent_fs", nonlinearity),
        // With the centripetal acceleration at the radius of the device.
        ("quadratic_s", quadratic - g_sensitivity_s_m * radius_m * chi_deg.to_radians().cos()),
        // Of the element without the low-pass of the chip.
        ("element_bandwidth_Hz", natural_Hz * ((-b + (b * b + 4.0).sqrt()) / 2.0).sqrt()),
        ("natural_Hz", natural_Hz),
        ("damping", damping),
        ("delay_s", imu.gyro.delay_s),
        ("radius_m", radius_m),
        ("accel_scale", accel_scale),
        ("angle_deg", chi_deg),
        ("bias_x_m_s2", accel_bias),
        ("bias_y_m_s2", accel_bias),
        ("crystal", crystal),
    ];
    (imu, truth)
}

/// Drive number `seed`: the default stand with each parameter changed by up to 20 %, and instruments with errors within the assumptions.
pub fn drawn_drive(seed: u64, assumed: &Assumptions) -> (Stand, Truth) {
    let mut d = Draw(Xoshiro256PlusPlus::seed_from_u64(seed));
    let mut stand = Stand::default();
    let vary = |d: &mut Draw, value: &mut f64, fraction: f64| *value *= 1.0 + fraction * d.side();
    vary(&mut d, &mut stand.drive.inertia_kg_m2, 0.2);
    vary(&mut d, &mut stand.drive.motor_constant_N_m_A, 0.2);
    vary(&mut d, &mut stand.drive.resistance_ohm, 0.2);
    for parameter in stand.effects.values_mut().flat_map(|p| p.values_mut()) {
        vary(&mut d, parameter, 0.2);
    }
    let at = |effect: &str, name: &str| stand.effects.get(effect).and_then(|p| p.get(name)).copied().unwrap_or(0.0);
    // A scale error of the voltage reading scales the identified K, R, L, and with K all torques.
    let volts = 1.0 + assumed.supply_percent / 100.0 * d.side();
    let current = assumed.current_percent / 100.0 * d.side();
    let truth = vec![
        ("inertia_kg_m2", volts * stand.drive.inertia_kg_m2),
        ("motor_constant_N_m_A", volts * stand.drive.motor_constant_N_m_A),
        ("resistance_ohm", volts * stand.drive.resistance_ohm),
        ("inductance_H", volts * at("inductance", "inductance_H")),
        ("viscous_N_m_s", volts * at("viscous", "viscous_N_m_s")),
        ("coulomb_N_m", volts * at("coulomb", "coulomb_N_m")),
        ("voltage_reading", volts),
    ];
    stand.effects.insert("current-scale".into(), [("current_scale".to_owned(), current)].into_iter().collect());
    (stand, truth)
}
