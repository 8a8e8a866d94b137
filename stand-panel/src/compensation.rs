//! Compensation on the stand from the page: what `stand compensate --port` does, with the ripple before and after.

use std::sync::Arc;
use std::time::Instant;

use embassy_futures::block_on;
use serde::Deserialize;
use serde_json::{Value, json};
use stand_firmware::compensation::Compensation;

use super::analysis::write_json;
use super::connection::PanelConnection;
use super::control::ClientId;
use super::jobs::{CANCELLED, Job, JobError};
use super::parts::Panel;
use super::stage::Stage;
use identification::log::Log;
use identification::model::Model;
use stand_acquire::link::REPLY_TIMEOUT;
use stand_acquire::settings;
use stand_analysis::compensate::serial_stand::{InForce, Writing, commands, measure, settings_of, write_model};
use stand_analysis::compensate::trial::Trial;
use stand_report::compensation::serial_json;

/// Harmonic orders of the plot.
const PLOTTED_ORDERS: u16 = 64;
/// Attempts to restore a compensation; each stop in between discards one.
const MAX_RESTORATIONS: u32 = 3;

/// What the page asks for.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CompensateRequest {
    client: ClientId,
    /// Fitted model; without it the stand measures its cogging and friction itself.
    model: Option<String>,
    /// Log that the model was fitted to.
    log: Option<String>,
    /// Save the compensation in the stand's flash.
    #[serde(default)]
    save: bool,
}

impl CompensateRequest {
    /// The command that does the same in a shell.
    ///
    /// # Errors
    /// The page does not drive, or a name is not one of the session.
    pub fn command(&self, panel: &Panel) -> Result<String, String> {
        panel.line.control().check(self.client, Instant::now()).map_err(|error| error.to_string())?;
        let mut command = format!("stand compensate --port {}", panel.line.name());
        for name in [&self.model, &self.log].into_iter().flatten() {
            panel.session.existing(name).map_err(|error| error.to_string())?;
        }
        match &self.model {
            Some(model) => command += &format!(" --model {model}"),
            None => command += " --measure-cogging",
        }
        if let Some(log) = &self.log {
            command += &format!(" --log {log}");
        }
        Ok(command + if self.save { " --save" } else { "" })
    }
}

/// Compensates; the name of the answer. After a stop or an error the previous compensation is in force again.
///
/// # Errors
/// In words.
pub fn run(panel: &Arc<Panel>, request: &CompensateRequest, job: &Job) -> Result<String, JobError> {
    job.stage(Stage::ReadingSettings, None);
    let stops = panel.line.stops();
    let mut stand = PanelConnection::new(panel.line.clone(), request.client);
    let before = block_on(settings_of(&mut stand)).map_err(|error| error.to_string())?.settings.compensation;
    let result = compensate(panel, &mut stand, request, job).map_err(|message| {
        if panel.line.stops() == stops {
            return message;
        }
        // The connection of a stopped job sends nothing more, so the panel itself restores.
        let is_restored = (0..MAX_RESTORATIONS).any(|_| restore(panel, &before));
        let outcome =
            if is_restored { "the previous compensation is in force" } else { "the compensation in force is unknown: COMPensation:LIST?" };
        format!("stopped; {outcome}")
    })?;
    let source = if request.model.is_some() { "model" } else { "measured" };
    let mut answer = serial_json(panel.line.name(), source, &result, request.save);
    answer["model"] = json!(request.model);
    answer["log"] = json!(request.log);
    answer["spectrum"] = result.trial.as_ref().map_or(Value::Null, spectrum);
    let name = panel.session.free_name("compensate", "json");
    write_json(&panel.session.new_file(&name).map_err(|error| error.to_string())?, &answer)?;
    Ok(name)
}

fn compensate(panel: &Panel, stand: &mut PanelConnection, request: &CompensateRequest, job: &Job) -> Result<InForce, String> {
    let writing = Writing { save: request.save, trial: true, goes_on: || !CANCELLED.load(std::sync::atomic::Ordering::Relaxed) };
    let path = |name: &String| panel.session.existing(name).map_err(|error| error.to_string());
    let result = match &request.model {
        Some(model) => {
            let model = Model::read(path(model)?).map_err(|error| error.to_string())?;
            let log = request.log.as_ref().map(|name| Log::read(path(name)?).map_err(|error| error.to_string())).transpose()?;
            job.stage(Stage::TurningTwice, None);
            block_on(write_model(stand, &model, log.as_ref(), writing))
        }
        None => {
            job.stage(Stage::MeasuringCogging { progress: String::new() }, None);
            block_on(measure(stand, writing, |progress| job.stage(Stage::MeasuringCogging { progress: progress.to_owned() }, None)))
        }
    };
    result.map_err(|error| error.to_string())
}

/// Amplitude of each order before and after, rad/s.
fn spectrum(trial: &Trial) -> Value {
    let of = |spectrum: &stand_analysis::compensate::OrderSpectrum| -> Vec<f64> {
        (1..=PLOTTED_ORDERS).map(|order| spectrum.amplitude(order)).collect()
    };
    json!({"orders": (1..=PLOTTED_ORDERS).collect::<Vec<_>>(), "before_rad_s": of(&trial.before), "after_rad_s": of(&trial.after)})
}

/// Writes the compensation without the control and reads it back; whether it is in force.
fn restore(panel: &Panel, compensation: &Compensation) -> bool {
    // A latched fault shows as the error of the next command; what counts is what is read back.
    let is_sent = commands(compensation).iter().all(|command| panel.line.restore(command, REPLY_TIMEOUT).is_ok());
    let in_force = || {
        let reply = panel.line.restore("*LRN?", REPLY_TIMEOUT).ok()?;
        let lines = reply.lines.into_iter().filter(|line| !line.is_empty()).collect();
        Some(settings::of_reply(lines).ok()?.kept().settings.compensation)
    };
    is_sent && in_force().as_ref() == Some(compensation)
}
