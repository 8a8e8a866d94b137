//! Bandwidth, phase, delay: lock-in against the encoder at the frequencies that were run, or along a chirp.

use super::{Given, samples};
use crate::calibrate::lock_in::{Response, lock_in};
use crate::calibrate::response::{Order, Transfer, transfer};
use crate::calibrate::{Curve, Findings, Step};
use crate::log::Log;
use crate::statistics::uncertainty::{Part, Quantity};

/// A step of the time stamp of the part under test, s (ISM330DHCX: DS13012, 25 µs).
const STAMP_S: f64 = 25e-6;

/// Less than this is no answer of the sensor to the platform.
const COHERENT: f64 = 0.02;

fn note(log: &Log, key: &str) -> Option<f64> {
    log.note(key).and_then(|text| text.split_whitespace().next()?.parse().ok())
}

/// The responses of all steps that are a sine or a chirp.
fn responses(steps: &[&Step], given: &Given) -> Vec<Response> {
    let mut found = Vec::new();
    for step in steps {
        let log = &step.log;
        let (Some(shown), Some(theta)) = (samples(log, given), log.column("theta_rad")) else { continue };
        // The age is of the part under test; the stand's own rate sensor is read at the row.
        let age = log.column("sensor_age_s").filter(|_| given.column != "omega_rad_s");
        let from = log.t_s().partition_point(|t| *t < log.t_s()[0] + given.settle_s);
        let t_s = &log.t_s()[from..];
        match log.note("profile") {
            Some("sine") => {
                let Some(frequency_Hz) = note(log, "profile_frequency_Hz") else { continue };
                found.extend(lock_in(t_s, &theta[from..], &shown[from..], age.map(|a| &a[from..]), frequency_Hz));
            }
            Some("chirp") => found.extend(along_chirp(log, theta, shown, age)),
            _ => {}
        }
    }
    found.retain(|r| r.coherence > COHERENT);
    found.sort_by(|a, b| a.frequency_Hz.total_cmp(&b.frequency_Hz));
    found
}

/// A chirp in pieces in which its frequency changes little: the gyro's samples on the platform's motion in the band of the piece.
pub(in crate::calibrate) fn along_chirp(log: &Log, theta: &[f64], shown: &[f64], age: Option<&[f64]>) -> Vec<Response> {
    let (Some(from_Hz), Some(to_Hz), Some(sweep_s)) =
        (note(log, "profile_from_Hz"), note(log, "profile_to_Hz"), note(log, "profile_sweep_s"))
    else {
        return Vec::new();
    };
    let t_s = log.t_s();
    let begin_s = t_s[0];
    let factor = (to_Hz / from_Hz).ln();
    let mut found = Vec::new();
    const PIECES: usize = 24;
    let frequency_Hz = |t: f64| from_Hz * (factor * (t - begin_s) / sweep_s).exp();
    for piece in 0..PIECES {
        let at = |k: usize| begin_s + sweep_s * k as f64 / PIECES as f64;
        let rows = t_s.partition_point(|t| *t < at(piece))..t_s.partition_point(|t| *t < at(piece + 1));
        if rows.len() < 200 {
            continue;
        }
        let [t_s, theta, shown] = [t_s, theta, shown].map(|column| &column[rows.clone()]);
        found.extend(piece_response(t_s, theta, shown, age.map(|a| &a[rows.clone()]), &frequency_Hz));
    }
    found
}

/// Fewer blocks than this are no piece.
const BLOCKS: usize = 4;

/// Within a piece the frequency moves: in each of its blocks both signals are demodulated by the block's own middle, so that what they have in common (the
/// moving phase) falls out; the response is what the blocks say of the piece's middle, straight in the frequency's logarithm.
fn piece_response(t_s: &[f64], theta: &[f64], shown: &[f64], age: Option<&[f64]>, frequency_Hz: &impl Fn(f64) -> f64) -> Option<Response> {
    use nalgebra::Complex;
    use std::f64::consts::TAU;
    let (first, last) = (*t_s.first()?, *t_s.last()?);
    let middle_Hz = frequency_Hz(0.5 * (first + last));
    // Blocks of two periods or more; each gives one pair of phasors.
    let blocks = ((last - first) * middle_Hz / 2.0).floor().min(24.0) as usize;
    if blocks < BLOCKS {
        return None;
    }
    let length = t_s.len() / blocks;
    let phasor = |t: &dyn Fn(usize) -> f64, y: &[f64], rows: std::ops::Range<usize>, f_Hz: f64| {
        let n = rows.len() as f64;
        let (mean, middle) = (y[rows.clone()].iter().sum::<f64>() / n, rows.start as f64 + 0.5 * (n - 1.0));
        let slope = rows.clone().map(|k| (k as f64 - middle) * (y[k] - mean)).sum::<f64>() / (n * n * n / 12.0);
        rows.map(|k| {
            let window = 1.0 + (TAU * (k as f64 - middle) / n).cos();
            Complex::from_polar(window * (y[k] - mean - slope * (k as f64 - middle)), -TAU * f_Hz * t(k))
        })
        .sum::<Complex<f64>>()
            * (2.0 / n)
    };
    let row = |k: usize| t_s[k];
    let taken = |k: usize| t_s[k] - age.map_or(0.0, |a| a[k]);
    // How far each block's frequency is from the middle's, the rate, what is shown.
    let each: Vec<(f64, Complex<f64>, Complex<f64>)> = (0..blocks)
        .map(|b| {
            let rows = b * length..(b + 1) * length;
            let f_Hz = frequency_Hz(0.5 * (t_s[rows.start] + t_s[rows.end - 1]));
            let rate = Complex::new(0.0, TAU * f_Hz) * phasor(&row, theta, rows.clone(), f_Hz);
            ((f_Hz / middle_Hz).ln(), rate, phasor(&taken, shown, rows, f_Hz))
        })
        .collect();
    let sum = |power: i32| each.iter().map(|(x, rate, _)| x.powi(power) * rate.norm_sqr()).sum::<f64>();
    let cross = |power: i32| each.iter().map(|(x, rate, shown)| shown * rate.conj() * x.powi(power)).sum::<Complex<f64>>();
    let (s0, s1, s2) = (sum(0), sum(1), sum(2));
    let determinant = s0 * s2 - s1 * s1;
    if determinant.is_nan() || determinant <= 0.0 {
        return None;
    }
    let (h, bend) = ((cross(0) * s2 - cross(1) * s1) / determinant, (cross(1) * s0 - cross(0) * s1) / determinant);
    let left: f64 = each.iter().map(|(x, rate, shown)| (shown - (h + bend * *x) * rate).norm_sqr()).sum();
    let all: f64 = each.iter().map(|(_, _, shown)| shown.norm_sqr()).sum();
    let variance = left / (2.0 * (blocks as f64 - 2.0));
    Some(Response {
        frequency_Hz: middle_Hz,
        re: h.re,
        im: h.im,
        sigma: (variance * s2 / determinant).sqrt(),
        coherence: 1.0 - left / all,
        rate_rad_s: (s0 / blocks as f64).sqrt(),
    })
}

/// Adds what the responses show.
pub(super) fn add(steps: &[&Step], given: &Given, findings: &mut Findings) {
    let found = responses(steps, given);
    let own = |s: &&Step| note(&s.log, "sensor_filter_Hz").filter(|_| given.column != "omega_rad_s");
    let filter_Hz = steps.iter().find_map(own);
    let Some(h) = transfer(&found, filter_Hz) else {
        return findings.lacks("bandwidth_Hz", "it takes sines of three frequencies or more, or a chirp (mode voltage)");
    };
    let scatter = |u: f64| {
        Part::measured("noise", u, h.dof, format!("{} frequencies; scatter {:.2} × their own uncertainty", found.len(), h.ratio.max(0.0)))
    };
    let highest_Hz = found.last().map_or(0.0, |r| r.frequency_Hz);
    match (h.bandwidth_Hz(), filter_Hz) {
        // A believed low-pass is no measurement.
        (Some(_), Some(chip_Hz)) if h.order() == Order::Delay => {
            let why =
                format!("up to {highest_Hz:.0} Hz nothing shows beside the chip's own low-pass of {chip_Hz:.0} Hz, which is believed");
            findings.lacks("bandwidth_Hz", why);
        }
        (Some((value, u)), _) => {
            let clock = Part::within("clock", given.known.crystal_ppm * 1e-6, "1", value, "crystal");
            let q = Quantity::new("bandwidth_Hz", "Hz", value, vec![scatter(u), clock]);
            let how = if value > highest_Hz {
                format!("; beyond {highest_Hz:.0} Hz, the highest that was run: by the fitted form")
            } else {
                String::new()
            };
            findings.quantities.push(q.saying(format!("where the gain has fallen by 3 dB; {}{how}", h.order().says())));
        }
        (None, _) => findings.lacks("bandwidth_Hz", format!("no fall by 3 dB is in sight of {highest_Hz:.0} Hz, the highest that was run")),
    }
    let beside = filter_Hz.map_or(String::new(), |f| format!("; behind it the chip's own low-pass of {f:.0} Hz, which is believed"));
    let (delay, u) = h.delay_s();
    let mut parts = vec![scatter(u)];
    if filter_Hz.is_some() {
        parts.push(Part::within(
            "time stamp",
            STAMP_S,
            "s",
            1.0,
            "the part under test stamps its samples in steps of 25 µs, and the stand reckons their age from that",
        ));
    }
    findings.quantities.push(
        Quantity::new("delay_s", "s", delay, parts)
            .saying(format!("transport delay, apart from the lag; the sample's own age taken off where the log has it{beside}")),
    );
    if let Some((zeta, u)) = h.damping() {
        findings
            .quantities
            .push(Quantity::new("damping", "1", zeta, vec![scatter(u)]).saying(format!("damping ratio of the pair of poles{beside}")));
    }
    let (scale, u) = h.scale();
    findings.quantities.push(Quantity::new("scale_dynamic", "1", scale, vec![scatter(u)]).saying("scale towards rest, by the sines"));
    findings.curves.extend(pictures(&found, &h));
}

fn pictures(found: &[Response], h: &Transfer) -> [Curve; 3] {
    let (low, high) = (found.first().map_or(1.0, |r| r.frequency_Hz), found.last().map_or(1.0, |r| r.frequency_Hz));
    let grid: Vec<f64> = (0..=100).map(|k| low * (high / low).powf(f64::from(k) / 100.0)).collect();
    [
        Curve::over_frequency(
            "Gain against the encoder",
            "shown over rate",
            found.iter().map(|r| (r.frequency_Hz, r.gain())).collect(),
            grid.iter().map(|f| (*f, h.at(*f).norm())).collect(),
        ),
        Curve::over_frequency(
            "Phase against the encoder",
            "phase, °",
            found.iter().map(|r| (r.frequency_Hz, r.phase_rad().to_degrees())).collect(),
            grid.iter().map(|f| (*f, h.at(*f).arg().to_degrees())).collect(),
        ),
        Curve::over_frequency(
            "Coherence",
            "part of the power that goes with the platform",
            found.iter().map(|r| (r.frequency_Hz, r.coherence)).collect(),
            Vec::new(),
        ),
    ]
}
