//! Many cycles become one answer: own drift, apparent drift, azimuth, each with its uncertainty, corrected and as they are.

use super::amplitudes::{LEAST_RATIO, Unequal, mean};
use super::integral::{Integral, reference_rad_s};
use super::places::{self, Found, Rate, Value};
use super::separate::{self, Platform};
use super::uncertainty::{Part, together};
use super::{DEG_H, DriftError};
use crate::report::finite;
use hal_sim::gyro::Place;
use serde_json::{Value as Json, json};

/// Places are the same within this, rad: 2″.
const SAME_RAD: f64 = 1e-5;

/// One cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct CycleLine {
    /// Its number.
    pub number: u32,
    /// Where it was measured.
    pub place: Place,
    /// Axis of the platform: 0 to 2; 0 for a gyro of one axis.
    pub axis: usize,
    /// Sign of its first pulse.
    pub sign: i8,
    /// When it began, s.
    pub start_s: f64,
    /// Its sums.
    pub integral: Integral,
    /// w, without sign, rad/s: as it was asked for, or by the angles, of a rectangular pulse that turns as far.
    pub amplitude_rad_s: f64,
    /// What the current says that the pulses were not equal by, rad/s; `None` where the current or K_m/H is not known.
    pub residual_rad_s: Option<f64>,
    /// Why it enters no mean.
    pub bad: Option<String>,
}

impl CycleLine {
    /// Without the residual, rad/s.
    pub fn rate_rad_s(&self) -> f64 {
        self.integral.drift_rad_s() - self.residual_rad_s.unwrap_or(0.0)
    }
}

/// All that was measured, and where.
#[derive(Debug, Clone)]
pub struct Measured {
    /// What it is called: the log, the port.
    pub name: String,
    /// The cycles.
    pub cycles: Vec<CycleLine>,
    /// Three axes, or one.
    pub has_three_axes: bool,
    /// Latitude, degrees, where it is known.
    pub latitude_deg: Option<f64>,
    /// Standard error of the turn to another place, rad.
    pub turn_error_rad: f64,
    /// Standard error of the level, rad.
    pub level_error_rad: f64,
    /// Relative standard error of K_k.
    pub gain_error: f64,
    /// What a person should know.
    pub warnings: Vec<String>,
}

/// What comes of it, rad/s and rad.
#[derive(Debug, Clone, PartialEq)]
pub struct Separated {
    /// ω_d; of three axes x, y, z.
    pub own_rad_s: Vec<Value>,
    /// ω_a in the first place; of three axes x, y, z.
    pub apparent_rad_s: Vec<Value>,
    /// A, where it can be told.
    pub azimuth_rad: Option<Value>,
    /// What gravity adds.
    pub places: Option<Found>,
    /// What pulses of two amplitudes tell of the torquer, for each axis; empty without them.
    pub unequal: Vec<Unequal>,
}

impl Separated {
    /// The other azimuth with the same apparent drift, rad: positions half a turn apart know its cosine alone.
    pub fn other_azimuth_rad(&self) -> Option<f64> {
        let by_cosine = self.places.as_ref().is_some_and(|found| found.across.is_none());
        self.azimuth_rad.filter(|_| by_cosine).map(|a| std::f64::consts::TAU - a.value)
    }
}

/// The answer.
#[derive(Debug, Clone)]
pub struct Answer {
    /// What it is made of.
    pub measured: Measured,
    /// With all corrections.
    pub corrected: Separated,
    /// By (13) to (16) alone.
    pub uncorrected: Separated,
    /// K_m i/H by the unswitched sums, rad/s, where both polarities were used.
    pub reference_rad_s: Option<f64>,
    /// Where the uncertainty comes from, for each axis.
    pub parts: Vec<Vec<Part>>,
}

/// Whether two places are one.
pub(super) fn same(a: &Place, b: &Place) -> bool {
    let turned = (a.turned_rad - b.turned_rad).rem_euclid(std::f64::consts::TAU);
    turned.min(std::f64::consts::TAU - turned) < SAME_RAD
        && (a.raised_rad - b.raised_rad).abs() < SAME_RAD
        && (a.rolled_rad - b.rolled_rad).abs() < SAME_RAD
}

impl Measured {
    fn good(&self) -> Vec<&CycleLine> {
        self.cycles.iter().filter(|cycle| cycle.bad.is_none()).collect()
    }

    /// The places in the order in which they come.
    fn places(&self) -> Vec<Place> {
        let mut places: Vec<Place> = Vec::new();
        for cycle in self.good() {
            if !places.iter().any(|place| same(place, &cycle.place)) {
                places.push(cycle.place);
            }
        }
        places
    }

    /// What two amplitudes tell of an axis.
    fn unequal(&self, axis: usize, rate: &dyn Fn(&CycleLine) -> f64) -> Option<Unequal> {
        Unequal::of(&self.good().into_iter().filter(|c| c.axis == axis).collect::<Vec<_>>(), rate)
    }

    fn means(&self, axis: usize, rate: &dyn Fn(&CycleLine) -> f64, unequal: Option<&Unequal>) -> Vec<Rate> {
        let of = |place: &Place| {
            let cycles: Vec<&CycleLine> = self.good().into_iter().filter(|c| c.axis == axis && same(&c.place, place)).collect();
            (!cycles.is_empty()).then(|| mean(&cycles, rate, unequal))
        };
        self.places()
            .iter()
            .filter_map(|place| of(place).map(|(rate_rad_s, sigma_rad_s)| Rate { place: *place, rate_rad_s, sigma_rad_s }))
            .collect()
    }

    /// The answer.
    ///
    /// # Errors
    /// No good cycle, no turn, a pole, places that do not tell apart what they show.
    pub fn answer(self) -> Result<Answer, DriftError> {
        if self.good().is_empty() {
            let reason = self.cycles.first().and_then(|cycle| cycle.bad.clone()).unwrap_or_default();
            return Err(DriftError::AllBad { log: self.name, count: self.cycles.len(), reason });
        }
        let earth = self.latitude_deg.map(separate::earth_rad_s).transpose()?;
        let (mut corrected, uncorrected) = if self.has_three_axes {
            (self.three(earth, &CycleLine::rate_rad_s, true)?, self.three(earth, &|c| c.integral.drift_rad_s(), false)?)
        } else {
            (self.single(earth, &CycleLine::rate_rad_s, true)?, self.single(earth, &|c| c.integral.drift_rad_s(), false)?)
        };
        let reference_rad_s = self.reference();
        let parts: Vec<Vec<Part>> = (0..corrected.own_rad_s.len()).map(|axis| self.parts(axis, earth, &corrected)).collect();
        for (axis, parts) in parts.iter().enumerate() {
            corrected.own_rad_s[axis].sigma = together(parts, |p| p.own_rad_s);
            corrected.apparent_rad_s[axis].sigma = together(parts, |p| p.apparent_rad_s);
        }
        if let Some(azimuth) = &mut corrected.azimuth_rad {
            azimuth.sigma = together(&parts[0], |p| p.azimuth_rad);
        }
        Ok(Answer { measured: self, corrected, uncorrected, reference_rad_s, parts })
    }

    fn single(&self, earth: Option<(f64, f64)>, rate: &dyn Fn(&CycleLine) -> f64, corrects: bool) -> Result<Separated, DriftError> {
        let unequal: Vec<Unequal> = self.unequal(0, rate).filter(|_| corrects).into_iter().collect();
        let rates = self.means(0, rate, unequal.first());
        let raised = rates.iter().any(|rate| rate.place.raised_rad.sin().abs() > 1e-9);
        if raised && earth.is_none() {
            return Err(DriftError::Positions {
                what: "own drift".into(),
                hint: "an axis is raised: --latitude must say what it feels of the Earth".into(),
            });
        }
        let found = places::fit(&rates, earth.map_or(0.0, |(_, vertical)| vertical))?;
        let azimuth_rad = match (found.across, earth) {
            (Some(across), _) => {
                let (c, s) = (found.along.value, across.value);
                let horizontal = c.hypot(s);
                let sigma = found.along.sigma.zip(across.sigma).map(|(of_c, of_s)| (s * of_c).hypot(c * of_s) / (horizontal * horizontal));
                Some(Value { value: s.atan2(c), sigma })
            }
            (None, Some((horizontal, _))) => separate::azimuth_rad(-found.along.value, horizontal)
                .map(|value| Value { value, sigma: found.along.sigma.map(|sigma| sigma / (horizontal * value.sin().abs().max(1e-6))) }),
            (None, None) => None,
        };
        let apparent = Value { value: -found.along.value, sigma: found.along.sigma };
        Ok(Separated { own_rad_s: vec![found.own], apparent_rad_s: vec![apparent], azimuth_rad, places: Some(found), unequal })
    }

    fn three(&self, earth: Option<(f64, f64)>, rate: &dyn Fn(&CycleLine) -> f64, corrects: bool) -> Result<Separated, DriftError> {
        let log = || self.name.clone();
        let (horizontal, vertical) = earth.ok_or_else(|| DriftError::Note { log: log(), note: "latitude_deg", option: "--latitude" })?;
        // All of them, or none.
        let unequal: Vec<Unequal> = (0..3).map_while(|axis| self.unequal(axis, rate).filter(|_| corrects)).collect();
        let unequal = if unequal.len() == 3 { unequal } else { Vec::new() };
        let axes: [Vec<Rate>; 3] = std::array::from_fn(|axis| self.means(axis, rate, unequal.get(axis)));
        let places = self.places();
        let [first, turned] = match places.as_slice() {
            [first] => return Err(DriftError::NoTurn { position: format!("turned {}°", first.turned_rad.to_degrees()) }),
            [first, turned] if ((turned.turned_rad - first.turned_rad).cos() + 1.0).abs() < 1e-3 => [first, turned],
            _ => {
                let hint = "three axes are separated by two positions, 180° apart";
                return Err(DriftError::Positions { what: "own and apparent drift".into(), hint: hint.into() });
            }
        };
        let mut rates = [[0.0; 3]; 2];
        let mut sigmas = [[None; 3]; 2];
        for (k, place) in [first, turned].into_iter().enumerate() {
            for axis in 0..3 {
                let mean = axes[axis].iter().find(|rate| same(&rate.place, place));
                let mean = mean.ok_or_else(|| DriftError::Log {
                    log: log(),
                    says: format!("no good cycle of axis {} in each position", ["x", "y", "z"][axis]),
                })?;
                (rates[k][axis], sigmas[k][axis]) = (mean.rate_rad_s, mean.sigma_rad_s);
            }
        }
        let pulse_s = self.good()[0].integral.pulse_s;
        let Platform { own_rad_s, azimuth_rad } =
            if corrects { separate::three(&rates, vertical, pulse_s) } else { separate::three_uncorrected(&rates, vertical) };
        let half = |axis: usize| sigmas[0][axis].zip(sigmas[1][axis]).map(|(a, b): (f64, f64)| a.hypot(b) / 2.0);
        let (sin, cos) = azimuth_rad.sin_cos();
        let sigma = half(0).zip(half(2)).map(|(x, z)| (sin * x).hypot(cos * z) / horizontal);
        let apparent = [-horizontal * cos, -vertical, horizontal * sin];
        // The apparent drift is the azimuth's and the latitude's, and that about the vertical the latitude's alone.
        let lever = [Some(horizontal * sin.abs()), None, Some(horizontal * cos.abs())];
        let of_azimuth = |axis: usize| Value { value: apparent[axis], sigma: sigma.zip(lever[axis]).map(|(sigma, lever)| sigma * lever) };
        Ok(Separated {
            own_rad_s: (0..3).map(|axis| Value { value: own_rad_s[axis], sigma: half(axis) }).collect(),
            apparent_rad_s: (0..3).map(of_azimuth).collect(),
            azimuth_rad: Some(Value { value: azimuth_rad - first.turned_rad, sigma }),
            places: None,
            unequal,
        })
    }

    fn reference(&self) -> Option<f64> {
        // Of several amplitudes that of the first.
        let first = self.good().first()?.amplitude_rad_s;
        let good: Vec<&CycleLine> =
            self.good().into_iter().filter(|c| (c.amplitude_rad_s / first - 1.0).abs() < (LEAST_RATIO - 1.0) / 2.0).collect();
        let of = |sign: i8| -> Option<Integral> {
            let cycles: Vec<_> =
                good.iter().filter(|c| c.sign == sign && c.axis == good[0].axis && same(&c.place, &good[0].place)).collect();
            let sum = cycles.iter().map(|c| c.integral.sum_rad_s).sum::<f64>() / cycles.len() as f64;
            cycles.first().map(|c| Integral { sum_rad_s: sum, ..c.integral })
        };
        Some(reference_rad_s(&of(1)?, &of(-1)?))
    }
}

impl Answer {
    /// The answer of interfaces.md.
    pub fn json(&self) -> Json {
        let m = &self.measured;
        let cycles: Vec<Json> = m
            .cycles
            .iter()
            .map(|c| {
                json!({
                    "number": c.number,
                    "axis": if m.has_three_axes { json!(["x", "y", "z"][c.axis]) } else { Json::Null },
                    "turned_deg": finite(c.place.turned_rad.to_degrees()),
                    "raised_deg": finite(c.place.raised_rad.to_degrees()),
                    "rolled_deg": finite(c.place.rolled_rad.to_degrees()),
                    "sequence": if c.sign < 0 { "-+" } else { "+-" },
                    "start_s": finite(c.start_s),
                    "pulse_s": finite(c.integral.pulse_s),
                    "amplitude_deg_s": finite(c.amplitude_rad_s.to_degrees()),
                    "drift_deg_h": finite(c.rate_rad_s() / DEG_H),
                    "raw_deg_h": finite(c.integral.drift_rad_s() / DEG_H),
                    "residual_deg_h": c.residual_rad_s.map_or(Json::Null, |r| finite(r / DEG_H)),
                    "slope_deg_h": finite(c.integral.slope_rad_s / DEG_H),
                    "bad": c.bad,
                })
            })
            .collect();
        let optional = |x: Option<f64>| x.map_or(Json::Null, finite);
        let rates = |values: &[Value]| {
            let one = |v: &Value| json!({"value": finite(v.value / DEG_H), "sigma": optional(v.sigma.map(|s| s / DEG_H))});
            match values {
                [v] => one(v),
                [x, y, z] => json!({"x": one(x), "y": one(y), "z": one(z)}),
                _ => Json::Null,
            }
        };
        let azimuth = |found: &Separated| {
            found.azimuth_rad.map_or(Json::Null, |a| {
                let other = found.other_azimuth_rad().map(f64::to_degrees);
                json!({"value": finite(a.value.to_degrees()), "sigma": optional(a.sigma.map(f64::to_degrees)), "or": optional(other)})
            })
        };
        let axis = |k: usize| if m.has_three_axes { json!(["x", "y", "z"][k]) } else { Json::Null };
        let part = |k: usize, p: &Part| {
            json!({
                "of": p.of,
                "axis": axis(k),
                "own_deg_h": optional(p.own_rad_s.map(|s| s / DEG_H)),
                "apparent_deg_h": optional(p.apparent_rad_s.map(|s| s / DEG_H)),
                "azimuth_arcmin": optional(p.azimuth_rad.map(|s| s.to_degrees() * 60.0)),
            })
        };
        let unequal: Vec<Json> = self
            .corrected
            .unequal
            .iter()
            .enumerate()
            .map(|(k, unequal)| json!({"axis": axis(k), "value": finite(unequal.inequality.value), "sigma": optional(unequal.inequality.sigma)}))
            .collect();
        let uncertainty: Vec<Json> =
            self.parts.iter().enumerate().flat_map(|(k, parts)| parts.iter().map(|p| part(k, p)).collect::<Vec<_>>()).collect();
        let by_g: Vec<Json> = self
            .corrected
            .places
            .iter()
            .flat_map(|found| found.by_g.iter().zip(["input", "output", "spin"]))
            .filter_map(|(value, axis)| {
                value.map(
                    |v| json!({"axis": axis, "value": finite(v.value / DEG_H), "sigma": v.sigma.map_or(Json::Null, |s| finite(s / DEG_H))}),
                )
            })
            .collect();
        json!({
            "name": m.name,
            "cycles": cycles,
            "good": m.good().len(),
            "bad": m.cycles.len() - m.good().len(),
            "own_drift_deg_h": rates(&self.corrected.own_rad_s),
            "apparent_drift_deg_h": rates(&self.corrected.apparent_rad_s),
            "azimuth_deg": azimuth(&self.corrected),
            "g_drift_deg_h_g": by_g,
            "latitude_deg": m.latitude_deg,
            "inequality": unequal,
            "reference_deg_s": self.reference_rad_s.map_or(Json::Null, |w| finite(w.to_degrees())),
            "uncertainty": uncertainty,
            "uncorrected": {
                "own_drift_deg_h": rates(&self.uncorrected.own_rad_s),
                "apparent_drift_deg_h": rates(&self.uncorrected.apparent_rad_s),
                "azimuth_deg": azimuth(&self.uncorrected),
            },
            "warnings": m.warnings,
        })
    }
}
