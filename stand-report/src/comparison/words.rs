//! Sentences about the channels of a comparison, and the glossary.

use super::Comparison;
use super::parameters::{Mark, ParameterRow, parameters};
use crate::{column, misfits, numbers, unit};
use identification::identify::evaluation::EvaluationRemark;
use identification::identify::fit::ChannelFit;
use identification::log::Axis;
use identification::model::Channel;

/// Ratio of rms to noise up to which a residual counts as noise.
pub const MAX_NOISE_RATIO: f64 = 1.05;

/// Size of a residual, from its ratio of rms to noise.
pub fn size(ratio: f64) -> String {
    if !ratio.is_finite() {
        "too few rows".to_owned()
    } else if ratio <= MAX_NOISE_RATIO {
        "at noise level".to_owned()
    } else {
        format!("{} × noise", numbers::significant(ratio, 3))
    }
}

/// The result of one channel in a sentence.
pub fn channel(axis: Axis, f: &ChannelFit) -> String {
    let ratio = f.rms / f.noise;
    let column = column(axis, f.channel);
    let noise = format!("{} {}", numbers::significant(f.noise, 2), unit(axis, f.channel));
    if !ratio.is_finite() {
        return format!("{column}: too few rows to compare.");
    }
    if ratio > MAX_NOISE_RATIO {
        return format!("{column}: the residual is {} × the noise ({noise}).", numbers::significant(ratio, 3));
    }
    let structure = (ratio * ratio - 1.0).max(0.0).sqrt();
    if f.white() {
        format!("{column}: the residual is white and at noise level ({noise}).")
    } else if f.channel == Channel::Angle && ratio < 1.0 {
        format!("{column}: the residual is at noise level ({noise}).")
    } else if structure > 0.0 {
        let percent = numbers::significant(100.0 * structure, 2);
        format!("{column}: the residual is at noise level ({noise}) but not white; its structure is at most {percent} % of the noise.")
    } else {
        format!("{column}: the residual is at noise level ({noise}) but not white.")
    }
}

/// The conclusion: what was found, and what to do next.
pub fn conclusion(c: &Comparison) -> String {
    let mut above: Vec<&ChannelFit> = c.result.channels.iter().filter(|f| f.rms / f.noise > MAX_NOISE_RATIO).collect();
    above.sort_by(|a, b| (b.rms / b.noise).total_cmp(&(a.rms / a.noise)));
    let (log, model) = (c.log.path().display(), c.model.name());
    let explain = format!("Next: `stand explain {log} --model {model}` searches the missing effect");
    if above.is_empty() {
        let departs = c.remarks.iter().find_map(|r| if let EvaluationRemark::HeldOutDeparts(d) = r { Some(d) } else { None });
        return departs.map_or_else(
            || adequate(c),
            |d| {
                let from_s = numbers::significant(d.from_s, 3);
                format!("The residual is at noise level in the fitted rows only. The model lacks what acts from {from_s} s on. {explain}.")
            },
        );
    }
    let ratio = |f: &ChannelFit| numbers::significant(f.rms / f.noise, 3);
    let list: Vec<String> = above.iter().map(|f| format!("{} at {} × noise", column(c.model.axis(), f.channel), ratio(f))).collect();
    let mut text = format!("Residual above the noise: {}.", list.join(", "));
    if c.fitted {
        text.push_str(" This is the best fit of the parameters, so the model lacks an effect.");
    }
    if let Some(first) = misfits::lines(c.model.axis(), c.misfits).first() {
        text.push(' ');
        text.push_str(first);
    }
    text.push_str(&if c.fitted {
        format!(" {explain}; `stand model add {model} EFFECT` adds one by hand.")
    } else {
        format!(" Next: `stand fit {log} --model {model}` fits the parameters; a residual that remains is due to a missing effect.")
    });
    text
}

fn adequate(c: &Comparison) -> String {
    let every = if c.result.channels.len() > 1 { " in every channel" } else { "" };
    let mut text = format!("The residual is at noise level{every}: no missing effect is visible in this log.");
    let rows = if c.fitted { parameters(c) } else { Vec::new() };
    let unphysical = |row: &ParameterRow| matches!(row.mark(), Mark::OutOfRange | Mark::ForcedToBound);
    let out: Vec<String> = rows.into_iter().filter(unphysical).map(|row| row.name).collect();
    if !out.is_empty() {
        text.push_str(&format!(" But {} left the physical range: do not use the model outside the range of this log.", out.join(", ")));
    }
    text
}

/// Terms of the report and their explanations.
pub const GLOSSARY: &[(&str, &str)] = &[
    ("residual", "measured minus modelled. The residual of a complete model is the noise of the sensors."),
    ("rms", "root mean square of the residual, in the unit of the channel."),
    (
        "noise",
        "standard deviation of the channel's own noise, estimated from its variation between neighbouring rows; at least that of its quantization step.",
    ),
    ("ratio", "rms over noise. 1: complete model, as far as this channel shows. 10: more than nine tenths of the residual is model error."),
    ("χ²/n", "the ratio squared. 1 is expected; more than 1 means that an effect is missing."),
    ("fit", "100 % × (1 − ‖residual‖/‖measured − mean‖). 100 %: everything is explained; 0 %: no better than the mean."),
    ("held-out", "rms over blocks of 2 s, every fourth, that the fit did not use. Much larger than the rms: overfitting."),
    (
        "white",
        "the residual is not autocorrelated (Ljung–Box test at a level of 0.001). A missing effect nearly always makes it autocorrelated.",
    ),
    (
        "± 1σ",
        "standard uncertainty of a fitted parameter: 68 % of repeated estimates lie within 1σ, 95 % within 2σ. \"At least 1σ\": the model leaves more than noise, or σ is mostly by what the log leaves open of the voltage within its rows; the parameters may be off by more.",
    ),
    (
        "not determined",
        "the outputs hardly depend on this parameter, or another parameter compensates for it. Its value has no meaning; its combination with the other may have.",
    ),
    ("correlation", "of the errors of two estimates. Close to +1 or −1: the log determines only one combination of the two."),
    ("angle increment", "the angle of a simulated model drifts without limit; therefore the motion within 20 ms is compared."),
];
