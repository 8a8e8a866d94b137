//! `stand compensate`: what was learnt goes into the firmware's compensation.

use std::path::{Path, PathBuf};

use clap::Args;
use hal_sim::plant::{Plant, Stand};
use hal_sim::session;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};
use stand_firmware::compensation::Compensation;
use stand_firmware::speed_loop::{Config, Settings};

use super::error::CliError;
use super::output::{JsonOutput, check_writable, spinner, write};
use crate::compensate::{Learnt, Ripple, RippleError, file, learn, ripple};
use crate::log::Log;
use crate::model::Model;

/// Rates at which the stand is looked at before and after, °/s.
const RATES_DEG_S: [f64; 3] = [10.0, 100.0, 720.0];

/// Write what was learnt into the firmware's compensation.
#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("source").required(true).args(["model", "measure_cogging"]))]
#[command(group = clap::ArgGroup::new("target").required(true).args(["stand", "port"]))]
pub(super) struct Compensate {
    /// The fitted model whose friction, cogging and unbalance are to be compensated, .toml
    #[arg(long)]
    pub(super) model: Option<PathBuf>,
    /// The log that the model was fitted to: it says from where the phases count
    #[arg(long, requires = "model")]
    pub(super) log: Option<PathBuf>,
    /// Without a model: the stand turns slowly both ways and measures its cogging and friction itself
    #[arg(long)]
    measure_cogging: bool,
    /// The simulated stand's file, .toml, whose settings are written; made from the default stand if it is not there
    #[arg(long, value_name = "FILE")]
    stand: Option<PathBuf>,
    /// The serial port of a stand, into which it is written
    #[arg(long, value_name = "P")]
    port: Option<PathBuf>,
    /// With --port: it is kept in the stand's flash, too
    #[arg(long, requires = "port")]
    pub(super) save: bool,
    /// Seed of the sensors' noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    pub(super) json: JsonOutput,
}

impl Compensate {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        match (&self.stand, &self.port) {
            (Some(file), _) => self.write_file(file),
            (None, Some(port)) => self.over_the_line(port),
            // The words were checked; there is one of the two.
            (None, None) => Ok(()),
        }
    }

    fn write_file(&self, path: &Path) -> Result<(), CliError> {
        check_writable(path)?;
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => file::NEW.to_owned(),
            Err(e) => return Err(CliError::file(path, "read", &e)),
        };
        let stand = parsed(&text, path)?;
        let learnt = match &self.model {
            Some(model) => of_a_model(model, self.log.as_deref(), &stand.firmware)?,
            None => self.measured(&stand, path)?,
        };
        let said = file::with_compensation(&text, &learnt.compensation).map_err(|e| of_file(path, &e))?;
        // What is written is what is tried: read back, with the digits of the file.
        let after = parsed(&said, path)?;
        let turned = turn(&stand, &after, self.seed)?;
        write(path, &said)?;
        let compensation = &after.firmware.compensation;
        self.json.text(&words(path, compensation, &learnt.left_out, &turned))?;
        let source = if self.model.is_some() { "model" } else { "measured" };
        self.json.json(|| answer(path, source, compensation, &learnt.left_out, &turned))
    }

    /// What the simulated stand finds out about itself.
    fn measured(&self, stand: &Stand, path: &Path) -> Result<Learnt, CliError> {
        let bar = ProgressBar::new(1000).with_message("the stand measures its cogging");
        if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {percent} %") {
            bar.set_style(style);
        }
        // Anywhere on the turn: a platform seldom stands at its index.
        let plant = Plant::new(stand, 2.0)?;
        let calibrated = session::calibrate(stand.setup(), plant, self.seed, |watch| bar.set_position((watch.percent() * 10.0) as u64))?;
        bar.finish_and_clear();
        let found = calibrated.outcome.map_err(|why| of_file(path, &why))?;
        let left_out = if found.compensation.harmonics.is_empty() {
            vec![format!("no order is above {} N m, which noise alone could reach", short(found.threshold_N_m))]
        } else {
            Vec::new()
        };
        Ok(Learnt { compensation: found.compensation, left_out })
    }
}

fn of_file(path: &Path, says: &dyn std::fmt::Display) -> CliError {
    CliError::Input(format!("{}: {says}", path.display()))
}

/// A stand of this text, with settings that its firmware takes.
fn parsed(text: &str, path: &Path) -> Result<Stand, CliError> {
    let stand = Stand::parse(text).map_err(|e| of_file(path, &e))?;
    stand.sensors.check().map_err(|e| of_file(path, &e))?;
    Config::new(&stand.firmware, &stand.hardware).map_err(|e| of_file(path, &e))?;
    Ok(stand)
}

pub(super) fn of_a_model(model: &Path, log: Option<&Path>, settings: &Settings) -> Result<Learnt, CliError> {
    let model = Model::read(model)?;
    let log = log.map(Log::read).transpose()?;
    learn(&model, log.as_ref(), settings).map_err(|e| CliError::Input(e.to_string()))
}

/// The stand at each rate, before and after.
fn turn(before: &Stand, after: &Stand, seed: u64) -> Result<Vec<[Ripple; 2]>, CliError> {
    let harmonics = after.firmware.compensation.harmonics;
    let orders: Vec<u16> = harmonics.as_slice().iter().map(|h| h.order).collect();
    let turning = spinner("the stand turns, before and after");
    let both = RATES_DEG_S.map(|rate| {
        let at = |stand: &Stand| ripple(stand, &stand.firmware.compensation, rate.to_radians(), &orders, seed);
        let pair = [at(before)?, at(after)?];
        if !harmonics.is_empty() && !pair[1].compensated {
            return Err(RippleError::IndexNotSeen(pair[1].rate_rad_s));
        }
        Ok(pair)
    });
    let both: Result<Vec<_>, RippleError> = both.into_iter().collect();
    turning.finish_and_clear();
    both.map_err(|e| CliError::Input(format!("nothing was written: {e}")))
}

fn words(path: &Path, compensation: &Compensation, left_out: &[String], turned: &[[Ripple; 2]]) -> String {
    let mut text = format!("{}: [firmware.compensation] is written\n", path.display());
    text += &format!("  dry friction {} N m, viscous {} N m s/rad\n", short(compensation.coulomb_N_m), short(compensation.viscous_N_m_s));
    for harmonic in compensation.harmonics.as_slice() {
        let (order, torque, phase) = (harmonic.order, short(harmonic.torque_N_m), harmonic.phase_rad);
        text += &format!("  order {order:>3}: {torque} N m, {phase:.4} rad from the index\n");
    }
    for line in left_out {
        text += &format!("  not compensated: {line}\n");
    }
    text += "\nIn the true rate of the simulated stand, before and after:\n";
    text += "     rate            amplitude before       after   falls by\n";
    for [before, after] in turned {
        let degrees = before.rate_rad_s.to_degrees();
        for ((order, was), (_, is)) in before.orders.iter().zip(&after.orders) {
            text += &format!("{degrees:>5.0} °/s  order {order:>3}   {:>9} rad/s {:>11} {:>8.0} ×\n", short(*was), short(*is), was / is);
        }
        let (was, is) = (before.one_degree, after.one_degree);
        text += &format!("{degrees:>5.0} °/s  over 1°     {:>9} %     {:>11} {:>8.1} ×\n", short(100.0 * was), short(100.0 * is), was / is);
    }
    text
}

fn answer(path: &Path, source: &str, compensation: &Compensation, left_out: &[String], turned: &[[Ripple; 2]]) -> Value {
    let number = |x: f64| if x.is_finite() { json!(x) } else { Value::Null };
    let ripple = turned.iter().map(|[before, after]| {
        let orders = before.orders.iter().zip(&after.orders).map(|((order, was), (_, is))| {
            json!({ "order": order, "before_rad_s": number(*was), "after_rad_s": number(*is), "factor": number(was / is) })
        });
        json!({
            "rate_rad_s": before.rate_rad_s,
            "orders": orders.collect::<Vec<_>>(),
            "one_degree": { "before": number(before.one_degree), "after": number(after.one_degree) },
        })
    });
    let harmonics = compensation.harmonics.as_slice().iter();
    json!({
        "stand": path.display().to_string(),
        "source": source,
        "compensation": {
            "coulomb_N_m": compensation.coulomb_N_m,
            "coulomb_fade_rad_s": compensation.coulomb_fade_rad_s,
            "viscous_N_m_s": compensation.viscous_N_m_s,
            "winding_lag_s": compensation.winding_lag_s,
            "harmonics": harmonics
                .map(|h| json!({ "order": h.order, "torque_N_m": h.torque_N_m, "phase_rad": h.phase_rad }))
                .collect::<Vec<_>>(),
        },
        "left_out": left_out,
        "ripple": ripple.collect::<Vec<_>>(),
    })
}

/// A number in three digits.
fn short(x: f64) -> String {
    if x != 0.0 && !(1e-3..1e4).contains(&x.abs()) { format!("{x:.2e}") } else { format!("{x:.4}") }
}
