//! Drift of a three-axis platform, evaluated from the angles of the simulated platform, and Monte Carlo runs of it.

use hal_sim::gyro::attitude::Vector;
use hal_sim::gyro::{ARCSEC, AngleSensor, Campaign, DEG_H, Pattern};
use hal_sim::peripherals::Noise;
use rayon::prelude::*;
use stand_analysis::drift::integral::Integral;
use stand_analysis::drift::separation::{PlatformDrift, three, three_uncorrected};

/// The rates of the three axes in both positions, rad/s: the mean over the cycles in which the axis had pulses.
pub fn rates_rad_s(campaign: &Campaign, noise: &mut Noise) -> [Vector; 2] {
    campaign.run(noise).map(|cycles| {
        std::array::from_fn(|axis| {
            let of_axis = cycles.iter().zip(campaign.pattern.cycles()).filter(|(_, signs)| signs[axis] != 0.0).filter_map(|(angles, _)| {
                let angles: Vec<f64> = angles.iter().map(|all| all[axis]).collect();
                Integral::of(&angles, campaign.pulse_s).map(|integral| integral.drift_rad_s())
            });
            let rates: Vec<f64> = of_axis.collect();
            rates.iter().sum::<f64>() / rates.len() as f64
        })
    })
}

/// Uncorrected and corrected.
pub fn separated(campaign: &Campaign, noise: &mut Noise) -> [PlatformDrift; 2] {
    let rates = rates_rad_s(campaign, noise);
    let vertical = campaign.site.vertical_rad_s();
    [three_uncorrected(&rates, vertical), three(&rates, vertical, campaign.pulse_s)]
}

/// Errors of the drifts, °/h, and of the azimuth, arcminutes.
pub fn errors(campaign: &Campaign, found: &PlatformDrift) -> (Vector, f64) {
    let off = std::array::from_fn(|axis| (found.own_rad_s[axis] - campaign.own_rad_s[axis]) / DEG_H);
    (off, (found.azimuth_rad - campaign.site.azimuth_rad).to_degrees() * 60.0)
}

/// A case of the table in docs/theory.md §3.3.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// Its name.
    pub name: &'static str,
    /// The campaign; initial attitude, drifts and noise are random.
    pub campaign: Campaign,
}

/// The cases with the values of docs/theory.md: mean relative error of the drift in percent; mean azimuth error in arcminutes, raw and
/// corrected.
pub fn cases() -> [(Case, [f64; 3]); 6] {
    let sensor = |noise: f64, step: f64| AngleSensor { noise_rad: noise * ARCSEC, step_rad: step * ARCSEC, ..AngleSensor::ideal() };
    let usual = Campaign { sensor: sensor(0.5, 1.0), ..Campaign::default() };
    let one = Pattern::Together;
    [
        (Case { name: "N1: noise 0.5″, step 1″, w = 0.05 °/s, both polarities", campaign: usual }, [0.244, 1.831, 1.461]),
        (
            Case {
                name: "N3: one polarity, w = 0.01 °/s",
                campaign: Campaign { pattern: one, rate_rad_s: 0.01_f64.to_radians(), ..usual },
            },
            [0.400, 2.066, 1.840],
        ),
        (Case { name: "N2: one polarity, w = 0.05 °/s", campaign: Campaign { pattern: one, ..usual } }, [1.406, 1.995, 1.757]),
        (
            Case { name: "N4: noise 1.5″, step 5″, both polarities", campaign: Campaign { sensor: sensor(1.5, 5.0), ..usual } },
            [0.732, 4.917, 4.778],
        ),
        (
            Case { name: "N6: N1 and 10″ of level, fixed to the base", campaign: Campaign { level_base_rad: 10.0 * ARCSEC, ..usual } },
            [0.246, 2.044, 1.526],
        ),
        (Case { name: "N7: N1 and 1′ of turn", campaign: Campaign { turn_error_rad: 60.0 * ARCSEC, ..usual } }, [0.245, 1.601, 1.482]),
    ]
}

/// Means over draws: relative error of the drifts, percent; azimuth error raw and corrected, arcminutes.
pub fn monte_carlo(case: &Case, draws: u64, seed: u64) -> [f64; 3] {
    let sums: [f64; 3] = (0..draws)
        .into_par_iter()
        .map(|draw| {
            let mut noise = Noise::new(seed.wrapping_mul(1_000_003).wrapping_add(draw), 0, 1.0);
            let own = std::array::from_fn(|_| {
                let drawn = noise.uniform(1.5);
                // ± 0.5 to 2 °/h.
                (drawn.abs() * 1.0 + 0.5) * drawn.signum() * DEG_H
            });
            let start_rad = std::array::from_fn(|_| noise.uniform(60.0 * ARCSEC));
            let campaign = Campaign { own_rad_s: own, start_rad, ..case.campaign };
            let [raw, corrected] = separated(&campaign, &mut noise);
            let ((off, azimuth), (_, azimuth_raw)) = (errors(&campaign, &corrected), errors(&campaign, &raw));
            let relative: f64 = off.iter().zip(own).map(|(off, own)| 100.0 * (off * DEG_H / own).abs()).sum::<f64>() / 3.0;
            [relative, azimuth_raw.abs(), azimuth.abs()]
        })
        .reduce(|| [0.0; 3], |a, b| std::array::from_fn(|k| a[k] + b[k]));
    sums.map(|sum| sum / draws as f64)
}
