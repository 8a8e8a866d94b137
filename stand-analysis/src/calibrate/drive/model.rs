//! Parameters of the drive model by output error from the step with the strongest excitation, and the inertia by a known added inertia.

use super::fitted_drive::{Drive, get};
use super::{clock, harmonics as torque_harmonics, reading_contributions};
use crate::calibrate::{AbsenceReason, Basis, Findings, Meaning, Remark, Step};
use crate::calibrate::{Contribution, Quantity};
use identification::budget::Budget;
use identification::deadline::Deadline;
use identification::identify::fit::{self, FitResult};
use identification::model::{Input, Model};
use identification::recording;
use identification::statistics::Extremes;
use stand_acquire::calibration_session::Session;

/// Effects of the model beside inertia, motor constant and resistance.
const EFFECTS: [&str; 3] = ["viscous", "coulomb", "inductance"];
/// Residual rms over noise from which the model counts as incomplete.
const MAX_MISFIT: f64 = 1.1;
/// Smallest change of J/K by an added inertia, in standard uncertainties.
const MIN_CHANGE_SIGMAS: f64 = 5.0;

/// The profile excites all parameters.
pub(super) fn is_exciting(step: &Step) -> bool {
    let has_note = |key: &str, words: &[&str]| step.log.note(key).is_some_and(|v| words.contains(&v));
    has_note("mode", &["voltage"]) && has_note("profile", &["multi-step", "prbs", "multisine"])
}

/// Cogging by the slow turns: harmonic order, amplitude, N m, phase, rad.
type Harmonics = [(usize, f64, f64)];

fn fitted(step: &Step, harmonics: &Harmonics, deadline: Deadline) -> Result<(FitResult, f64), String> {
    let mut model = Model::new(Input::Voltage, "drive").map_err(|e| e.to_string())?;
    for effect in EFFECTS {
        model.add(effect).map_err(|e| e.to_string())?;
    }
    for (k, (order, amplitude_N_m, phase_rad)) in harmonics.iter().enumerate() {
        let mark = if k == 0 { String::new() } else { format!("#{}", k + 1) };
        model.add(&format!("cogging{mark}")).map_err(|e| e.to_string())?;
        for (name, value) in [("N_m", *amplitude_N_m), ("order", *order as f64), ("phase_rad", *phase_rad)] {
            model.set(&format!("cogging_{name}{mark}"), value).map_err(|e| e.to_string())?;
        }
    }
    let (prepared, _) = recording::prepare(&step.log, &model, false).map_err(|e| e.to_string())?;
    let prepared = prepared.spending(Budget::new(None, deadline));
    let (system, parameters) = fit::build::system(&model, prepared.temp_C.is_some());
    let result = fit::fit(&system, &parameters, &prepared).map_err(|e| e.to_string())?;
    let misfit = result.channels.iter().map(|c| c.rms / c.noise).max_or_zero();
    Ok((result, misfit))
}

/// Adds the parameters.
pub(super) fn add(steps: &[Step], session: &Session, deadline: Deadline, findings: &mut Findings) -> Option<Drive> {
    let add_all_absent = |findings: &mut Findings, reason: AbsenceReason| {
        for name in ["inertia_kg_m2", "motor_constant_N_m_A", "resistance_ohm", "inductance_H", "viscous_N_m_s", "coulomb_N_m"] {
            findings.add_absent(name, reason.clone());
        }
    };
    let Some(step) = steps.iter().find(|s| is_exciting(s) && s.added_inertia_kg_m2.is_none()) else {
        add_all_absent(findings, AbsenceReason::NeedsExcitation);
        return None;
    };
    let (mut result, mut misfit) = match fitted(step, &[], deadline) {
        Ok(found) => found,
        Err(message) => {
            add_all_absent(findings, AbsenceReason::FitFailed { message });
            return None;
        }
    };
    // Cogging biases the other parameters, so the harmonics found in the slow turns become part of the model.
    let mut harmonics = Vec::new();
    if misfit > MAX_MISFIT
        && let Some(rough) = Drive::of(&result, misfit)
    {
        harmonics = torque_harmonics::strongest(steps, &rough, session);
        match fitted(step, &harmonics, deadline) {
            Ok((with, left)) if !harmonics.is_empty() && left < misfit => {
                (result, misfit) = (with, left);
                let harmonic_orders = harmonics.iter().map(|(order, ..)| *order).collect();
                findings.remarks.push(Remark::CoggingInModel { harmonic_orders });
            }
            _ => harmonics.clear(),
        }
    }
    if misfit > MAX_MISFIT {
        findings.remarks.push(Remark::Misfit { step: step.name.clone(), effects: EFFECTS.to_vec(), ratio: misfit });
    }
    // Exponents of the voltage and current readings: K is V s/rad, R is V/A, torques are K times A.
    let table = [
        ("inertia_kg_m2", "kg m²", [1, 1]),
        ("motor_constant_N_m_A", "N m/A", [1, 0]),
        ("resistance_ohm", "Ω", [1, -1]),
        ("inductance_H", "H", [1, -1]),
        ("viscous_N_m_s", "N m s/rad", [1, 1]),
        ("coulomb_N_m", "N m", [1, 1]),
    ];
    for (name, unit, exponents) in table {
        match get(&result, name) {
            Some((value, sigma)) => {
                let u = sigma * misfit.max(1.0);
                let mut contributions = vec![Contribution::type_a("noise and regression", u, f64::INFINITY, Basis::OutputError)];
                contributions.extend(reading_contributions(session, value, exponents));
                findings.quantities.push(Quantity::new(name, unit, value, contributions).meaning(Meaning::OutputError));
            }
            None => findings.add_absent(name, AbsenceReason::NotDetermined),
        }
    }
    let (j, k, r) = (get(&result, "inertia_kg_m2")?, get(&result, "motor_constant_N_m_A")?, get(&result, "resistance_ohm")?);
    let b = get(&result, "viscous_N_m_s").unwrap_or((0.0, 0.0));
    time_constants(findings, session, &result, misfit, [j.0, k.0, r.0, b.0]);
    inertia_by_added(steps, &result, &harmonics, deadline, findings);
    Drive::of(&result, misfit)
}

/// τ_m = J R/(K² + R b), τ_e = L/R. Scale errors of voltage and current cancel in both, except for the small part of b; so do most errors
/// of the fit, whose parameters are correlated (GUM 5.2.2). The clock is that of the stand.
fn time_constants(findings: &mut Findings, session: &Session, result: &FitResult, misfit: f64, [j, k, r, b]: [f64; 4]) {
    let u_of = |gradient: &[(&str, f64)]| {
        let place = |name: &str| result.parameters.list.iter().position(|p| p.name == name);
        let terms: Vec<(usize, f64)> = gradient.iter().filter_map(|(name, g)| Some((place(name)?, *g))).collect();
        let products = terms.iter().flat_map(|(i, g)| terms.iter().map(move |(j, h)| g * h * result.covariance[(*i, *j)]));
        products.sum::<f64>().max(0.0).sqrt() * misfit.max(1.0)
    };
    let contribution = |u: f64| Contribution::type_a("regression", u, f64::INFINITY, Basis::CorrelatedParameters);
    let denominator = k * k + r * b;
    let value = j * r / denominator;
    let u = u_of(&[
        ("inertia_kg_m2", value / j),
        ("resistance_ohm", value / r * k * k / denominator),
        ("motor_constant_N_m_A", -2.0 * value * k / denominator),
        ("viscous_N_m_s", -value * r / denominator),
    ]);
    findings.quantities.push(
        Quantity::new("mechanical_time_constant_s", "s", value, vec![contribution(u), clock(session, -value)])
            .meaning(Meaning::MechanicalTimeConstant),
    );
    if let Some((l, _)) = get(result, "inductance_H").filter(|l| l.0 > 0.0) {
        let value = l / r;
        let u = u_of(&[("inductance_H", 1.0 / r), ("resistance_ohm", -value / r)]);
        findings.quantities.push(
            Quantity::new("electrical_time_constant_s", "s", value, vec![contribution(u), clock(session, -value)])
                .meaning(Meaning::ElectricalTimeConstant),
        );
    }
}

/// Two fits, with and without a known added inertia. The difference of the inertias is known, so the ratio of J/K gives J independently of
/// the scales of current and voltage.
fn inertia_by_added(steps: &[Step], result: &FitResult, harmonics: &Harmonics, deadline: Deadline, findings: &mut Findings) {
    let name = "inertia_by_added_kg_m2";
    let Some(step) = steps.iter().find(|s| is_exciting(s) && s.added_inertia_kg_m2.is_some()) else {
        return findings.add_absent(name, AbsenceReason::NeedsAddedInertia);
    };
    let added = step.added_inertia_kg_m2.unwrap_or(0.0);
    let with = match fitted(step, harmonics, deadline) {
        Ok((with, _)) => with,
        Err(message) => return findings.add_absent(name, AbsenceReason::FitFailed { message }),
    };
    // J/K of both fits, which have the same K.
    let ratio = |result: &FitResult| Some((get(result, "inertia_kg_m2")?, get(result, "motor_constant_N_m_A")?));
    let (Some(((j1, u1), (k1, _))), Some(((j2, u2), (k2, _)))) = (ratio(result), ratio(&with)) else { return };
    let (a1, a2) = (j1 / k1, j2 / k2);
    let (ua1, ua2) = (u1 / k1, u2 / k2);
    if (a2 - a1).is_nan() || a2 - a1 <= MIN_CHANGE_SIGMAS * ua1.hypot(ua2) {
        return findings.add_absent(name, AbsenceReason::AddedInertiaInvisible);
    }
    let value = added * a1 / (a2 - a1);
    let per = added / (a2 - a1).powi(2);
    let contributions = vec![
        Contribution::type_a("without it", per * a2 * ua1, f64::INFINITY, Basis::OutputErrorRatio),
        Contribution::type_a("with it", per * a1 * ua2, f64::INFINITY, Basis::OutputErrorRatio),
    ];
    findings.quantities.push(Quantity::new(name, "kg m²", value, contributions).meaning(Meaning::InertiaByAddedInertia));
}
