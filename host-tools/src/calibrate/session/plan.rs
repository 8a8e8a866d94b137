//! A step's profile, checked as far as it can be without a stand.

use super::stable::OVER_S;
use super::{How, StepPlan};
use hal_sim::session::SessionRequest;
use stand_firmware::profile::{PARAMETERS, Parameter, Profile, ProfileConfig, ProfileKind};

impl StepPlan {
    /// The profile, checked; `None` where the drive is off.
    ///
    /// # Errors
    /// What is wrong, in words.
    pub fn config(&self) -> Result<Option<ProfileConfig>, String> {
        if self.name.trim().is_empty() || self.name.chars().any(char::is_control) {
            return Err("name: must be a word".into());
        }
        if !(self.seconds.is_finite() && (0.1..=1e6).contains(&self.seconds)) {
            return Err(format!("seconds: {} is outside 0.1 … 1000000", self.seconds));
        }
        if let Some(m) = self
            .mounted
            .filter(|m| !(m.radius_m.is_finite() && m.radius_m.abs() < 10.0 && m.tilt_deg.abs() < 90.0 && m.turned_deg.is_finite()))
        {
            return Err(format!("mounted: {m:?} is no place on a platform"));
        }
        if let Some(drive_s) = self.drive_s.filter(|d| !(*d >= 0.1 && *d < self.seconds && self.mode != How::Off)) {
            return Err(format!("drive_s: {drive_s} must be at least 0.1, and less than seconds, in a step with a profile"));
        }
        if let Some(slope) = self.stable_K_min.filter(|s| !(*s > 0.0 && s.is_finite() && self.seconds > OVER_S)) {
            return Err(format!("stable_K_min: {slope} must be above 0, in a step of more than {OVER_S} s"));
        }
        if let Some(j) = self.added_inertia_kg_m2.filter(|j| !(*j > 0.0 && j.is_finite())) {
            return Err(format!("added_inertia_kg_m2: {j} must be above 0"));
        }
        if self.mode == How::Off {
            return match (&self.profile, self.parameters.keys().next()) {
                (Some(_), _) => Err("profile: the drive is off in this step".into()),
                (_, Some(name)) => Err(format!("{name}: no such parameter; the drive is off in this step")),
                _ => Ok(None),
            };
        }
        let Some(profile) = &self.profile else {
            return Err("profile: is missing (`stand record --help` has the profiles)".into());
        };
        let kind: ProfileKind = profile.parse().map_err(|e| format!("profile: `{profile}`: {e}"))?;
        let amplitude = SessionRequest::usual_amplitude(self.mode.mode());
        let mut config = SessionRequest::usual_profile(self.mode.mode(), kind, amplitude, 1);
        for (name, value) in &self.parameters {
            let Some(parameter) = Parameter::of_name(name) else {
                let near = strsim_near(name);
                return Err(format!("{name}: no such parameter{near}"));
            };
            if !kind.parameters().contains(&name.as_str()) {
                return Err(format!("{name}: the profile {kind} takes {} and not this", kind.parameters().join(" ")));
            }
            let number =
                value.as_float().or(value.as_integer().map(|i| i as f64)).ok_or_else(|| format!("{name}: {value} is no number"))?;
            parameter.set(&mut config, number).map_err(|e| e.to_string())?;
        }
        Profile::for_mode(&config, self.mode.mode()).map_err(|e| e.to_string())?;
        Ok(Some(config))
    }

    /// Its log's name in the folder, for the step of this number from 1.
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

fn strsim_near(name: &str) -> String {
    let near = PARAMETERS.iter().map(|p| (strsim::jaro_winkler(p.name, name), p.name)).max_by(|a, b| a.0.total_cmp(&b.0));
    near.filter(|(score, _)| *score > 0.8).map_or(String::new(), |(_, near)| format!("; did you mean {near}?"))
}
