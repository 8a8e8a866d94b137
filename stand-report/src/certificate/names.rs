//! Names of quantities as the standards write them (IEEE Std 528, IEEE Std 1293); records and limits have the keys.

/// Keys with their names; every other key is written in words, without its unit.
const NAMES: [(&str, &str); 27] = [
    ("angle_deg", "angle of the x axis to the radius"),
    ("asymmetry_percent", "scale factor asymmetry"),
    ("bandwidth_Hz", "bandwidth"),
    ("bias_rad_s", "bias"),
    ("bias_x_m_s2", "bias, x axis"),
    ("bias_y_m_s2", "bias, y axis"),
    ("blind_below_rad_s", "rate below which the accelerometer shows no rate"),
    ("coast_decay_1_s", "decay rate of coasting"),
    ("coast_dry_rad_s2", "deceleration of coasting by dry friction"),
    ("combined_rms_rad_s", "rms deviation of the combined rate"),
    ("cross_axis_percent", "cross-axis sensitivity"),
    ("dead_band_rad_s", "dead band"),
    ("encoder_cosine_rad", "encoder error, cosine of the angle"),
    ("encoder_sine_rad", "encoder error, sine of the angle"),
    ("g_sensitivity_rad_s_g", "linear acceleration sensitivity"),
    ("hysteresis_percent_fs", "hysteresis error"),
    ("in_run_stability_rad_s", "in-run bias stability"),
    ("mounting_deg", "misalignment of the input axis"),
    ("nonlinearity_percent_fs", "linearity error"),
    ("quadratic_s", "second-order scale factor coefficient"),
    ("radius_m", "radius of the sensing element"),
    ("repeatability_percent_fs", "repeatability"),
    ("scale", "scale factor"),
    ("scale_dynamic", "scale factor, dynamic"),
    ("scale_whole_turns", "scale factor over whole turns"),
    ("turn_on_repeatability_rad_s", "turn-on to turn-on bias repeatability"),
    ("warm_up_change_rad_s", "bias change during warm-up"),
];

/// The name of a quantity with this key and unit.
pub(super) fn name(key: &str, unit: &str) -> String {
    if let Some((_, name)) = NAMES.iter().find(|(known, _)| *known == key) {
        return (*name).to_owned();
    }
    let parts: Vec<&str> = key.split('_').collect();
    if let [device @ ("accel" | "gyro"), axis @ ("x" | "y" | "z"), rest @ ..] = parts.as_slice() {
        let device = if *device == "accel" { "accelerometer" } else { "gyro" };
        let of = match rest {
            ["bias", ..] => "bias".to_owned(),
            ["scale", ..] => "scale factor".to_owned(),
            ["by", other] => format!("cross-axis sensitivity to {other}"),
            ["k2", ..] => "second-order coefficient K2".to_owned(),
            ["k3", ..] => "third-order coefficient K3".to_owned(),
            other => other.join(" "),
        };
        return format!("{device} {axis}, {of}");
    }
    let suffix: String = unit
        .chars()
        .filter_map(|c| match c {
            '/' | '·' | ' ' => Some('_'),
            '²' => Some('2'),
            '°' => None,
            other => Some(other),
        })
        .collect();
    let bare = key.strip_suffix(&suffix).filter(|_| !suffix.is_empty()).unwrap_or(key);
    bare.trim_end_matches("_deg").trim_end_matches('_').replace('_', " ")
}

#[cfg(test)]
mod tests {
    use super::name;

    #[test]
    fn keys_become_names_without_units() {
        for (key, unit, expected) in [
            ("bias_rad_s", "rad/s", "bias"),
            ("scale", "1", "scale factor"),
            ("accel_x_by_y", "1", "accelerometer x, cross-axis sensitivity to y"),
            ("gyro_z_bias_rad_s", "rad/s", "gyro z, bias"),
            ("threshold_rad_s", "rad/s", "threshold"),
            ("electrical_time_constant_s", "s", "electrical time constant"),
            ("inertia_by_coasting_kg_m2", "kg m²", "inertia by coasting"),
            ("rate_per_voltage_rad_s_V", "rad/s/V", "rate per voltage"),
            ("order_8_N_m", "N m", "order 8"),
        ] {
            assert_eq!(name(key, unit), expected);
        }
    }
}
