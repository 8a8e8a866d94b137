//! Profile of a step, checked as far as possible without a stand.

use super::stable::SLOPE_WINDOW_S;
use super::{DriveMode, StepPlan};
use hal_sim::session::SessionRequest;
use stand_firmware::profile::{PARAMETERS, Parameter, Profile, ProfileConfig, ProfileKind};

impl StepPlan {
    /// The checked profile; `None` where the drive is off.
    ///
    /// # Errors
    /// What is wrong with the step, with the parameter.
    pub fn config(&self) -> Result<Option<ProfileConfig>, String> {
        if self.name.trim().is_empty() || self.name.chars().any(char::is_control) {
            return Err("name: must be a word without control characters".into());
        }
        if !(self.seconds.is_finite() && (0.1..=1e6).contains(&self.seconds)) {
            return Err(format!("seconds: {} is outside 0.1 … 1000000", self.seconds));
        }
        if let Some(m) = self
            .mounting
            .filter(|m| !(m.radius_m.is_finite() && m.radius_m.abs() < 10.0 && m.tilt_deg.abs() < 90.0 && m.turned_deg.is_finite()))
        {
            return Err(format!("mounted: radius_m must be below 10 m and tilt_deg below 90°: {m:?}"));
        }
        if let Some(drive_s) = self.drive_s.filter(|d| !(*d >= 0.1 && *d < self.seconds && self.mode != DriveMode::Off)) {
            return Err(format!("drive_s: {drive_s} must be at least 0.1 and less than seconds; the step needs a profile"));
        }
        if let Some(slope) = self.stable_K_min.filter(|s| !(*s > 0.0 && s.is_finite() && self.seconds > SLOPE_WINDOW_S)) {
            return Err(format!("stable_K_min: {slope} must be above 0, in a step of more than {SLOPE_WINDOW_S} s"));
        }
        if let Some(j) = self.added_inertia_kg_m2.filter(|j| !(*j > 0.0 && j.is_finite())) {
            return Err(format!("added_inertia_kg_m2: {j} must be above 0"));
        }
        if self.mode == DriveMode::Off {
            return match (&self.profile, self.parameters.keys().next()) {
                (Some(_), _) => Err("profile: not allowed in a step with mode = \"off\"".into()),
                (_, Some(name)) => Err(format!("{name}: unknown parameter; a step with mode = \"off\" has none")),
                _ => Ok(None),
            };
        }
        let Some(profile) = &self.profile else {
            return Err("profile: is missing (`stand record --help` lists the profiles)".into());
        };
        let kind: ProfileKind = profile.parse().map_err(|e| format!("profile: `{profile}`: {e}"))?;
        let amplitude = SessionRequest::usual_amplitude(self.mode.mode());
        let mut config = SessionRequest::usual_profile(self.mode.mode(), kind, amplitude, 1);
        for (name, value) in &self.parameters {
            let Some(parameter) = Parameter::of_name(name) else {
                let suggestion = suggestion(name);
                return Err(format!("{name}: unknown parameter{suggestion}"));
            };
            if !kind.parameters().contains(&name.as_str()) {
                return Err(format!("{name}: not a parameter of the profile {kind}, which has {}", kind.parameters().join(" ")));
            }
            let number =
                value.as_float().or(value.as_integer().map(|i| i as f64)).ok_or_else(|| format!("{name}: {value} is not a number"))?;
            parameter.set(&mut config, number).map_err(|e| e.to_string())?;
        }
        Profile::for_mode(&config, self.mode.mode()).map_err(|e| e.to_string())?;
        Ok(Some(config))
    }

    /// File name of the log of step `number`, counted from 1.
    pub fn file(&self, number: usize) -> String {
        let word: String = self
            .name
            .chars()
            .map(|c| {
                if c.is_alphanumeric() {
                    c.to_ascii_lowercase()
                } else if c == '+' {
                    'p'
                } else if c == '-' {
                    'm'
                } else {
                    '-'
                }
            })
            .collect();
        format!("{number:02}-{word}.parquet")
    }
}

/// The known parameter with the most similar name.
fn suggestion(name: &str) -> String {
    let nearest = PARAMETERS.iter().map(|p| (strsim::jaro_winkler(p.name, name), p.name)).max_by(|a, b| a.0.total_cmp(&b.0));
    nearest.filter(|(score, _)| *score > 0.8).map_or(String::new(), |(_, name)| format!("; did you mean {name}?"))
}
