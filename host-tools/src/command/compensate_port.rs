//! `stand compensate --port`: what was learnt goes into a stand over its serial line, by console commands that it checks.
//!
//! The stand's own settings are asked for first, since its firmware makes volts of torque by them. Orders have phases from the index, so a stand that has
//! not seen its index is refused: nobody could say where its platform is. Nothing is half done: what the stand refuses is told, and what was in
//! force before is put back.

use std::path::Path;
use std::time::Duration;

use serde_json::json;
use stand_firmware::compensation::Compensation;
use stand_firmware::settings::{FIELDS, Kept};

use super::compensate::{Compensate, of_a_model};
use super::error::CliError;
use super::record::has_index;
use crate::acquire::link::{LinkError, SerialLink};

/// How long is looked whether the stand knows its index.
const LOOK: Duration = Duration::from_millis(500);

impl Compensate {
    /// Writes what `model` teaches into the stand at `port`.
    pub(super) fn over_the_line(&self, port: &Path) -> Result<(), CliError> {
        let Some(model) = &self.model else { return self.measured_by_itself(port) };
        let mut link = SerialLink::open(port)?;
        let kept = kept(&mut link)?;
        let learnt = of_a_model(model, self.log.as_deref(), &kept.settings)?;
        let compensation = learnt.compensation;
        // What the firmware would refuse, before anything is changed.
        let mut after = kept;
        after.settings.compensation = compensation;
        after.config().map_err(|e| CliError::Input(format!("{}: {e}", model.display())))?;
        if !compensation.harmonics.is_empty() && !knows_index(&mut link)? {
            return Err(CliError::Input(format!(
                "{}: the stand has not seen its index, so the orders' phases mean nothing to it; turn the platform once by hand or by SOURce:RATE",
                link.name()
            )));
        }
        let before = kept.settings.compensation;
        if let Err(refused) = orders(&compensation).iter().try_for_each(|order| link.command(order)) {
            for order in orders(&before) {
                link.command(&order)?;
            }
            return Err(CliError::Input(format!("{refused}; the compensation is what it was")));
        }
        if self.save {
            link.command("SETTings:SAVE")?;
        }
        self.told(&mut link, "model", &learnt.left_out)
    }

    /// The stand turns slowly both ways and finds its cogging and friction itself.
    fn measured_by_itself(&self, port: &Path) -> Result<(), CliError> {
        let mut link = SerialLink::open(port)?;
        link.command("CALibration:COGGing:STARt")?;
        let bar = super::output::spinner("the stand measures its cogging");
        let found = loop {
            std::thread::sleep(Duration::from_millis(500));
            let says = link.query("CALibration:COGGing?")?;
            if !says.starts_with("RUNNING") {
                break says;
            }
            bar.set_message(format!("the stand measures its cogging, {}", link.query("CALibration:COGGing:PROGress?")?));
        };
        bar.finish_and_clear();
        if !found.starts_with("DONE") {
            return Err(CliError::Input(format!("{}: {found}", link.name())));
        }
        if self.save {
            link.command("SETTings:SAVE")?;
        }
        self.told(&mut link, "measured", &[])
    }

    /// What is in force now, by the stand's own words.
    fn told(&self, link: &mut SerialLink, source: &str, left_out: &[String]) -> Result<(), CliError> {
        let lines = link.query_lines("COMPensation:LIST?")?;
        let mut text =
            format!("{}: the compensation is in force{}\n", link.name(), if self.save { " and saved" } else { "; SETTings:SAVE keeps it" });
        lines.iter().for_each(|line| text += &format!("  {line}\n"));
        left_out.iter().for_each(|line| text += &format!("  not compensated: {line}\n"));
        self.json.text(&text)?;
        self.json.json(|| json!({ "port": link.name(), "source": source, "in_force": lines, "saved": self.save, "left_out": left_out }))
    }
}

/// The orders that put a compensation in force. Numbers go in the shortest form that reads back the same.
fn orders(compensation: &Compensation) -> Vec<String> {
    let mut orders = vec![
        "COMPensation:CLEar".to_owned(),
        format!("COMPensation:COULomb {:e} N.M", compensation.coulomb_N_m),
        format!("COMPensation:VISCous {:e} N.M.S", compensation.viscous_N_m_s),
    ];
    let harmonics = compensation.harmonics.as_slice().iter();
    orders.extend(harmonics.map(|h| format!("COMPensation:HARMonic {},{:e} N.M,{:e} RAD", h.order, h.torque_N_m, h.phase_rad)));
    orders
}

/// All settings of the stand that this program knows.
fn kept(link: &mut SerialLink) -> Result<Kept, CliError> {
    let mut kept = Kept::default();
    for field in FIELDS {
        match link.query(&format!("SETTings:{}?", field.name)) {
            Ok(reply) => {
                let number = reply.split_whitespace().next().and_then(|number| number.parse().ok());
                let number: f64 = number.ok_or_else(|| CliError::Other(format!("SETTings:{}? is no number: `{reply}`", field.name)))?;
                (field.write)(&mut kept, number);
            }
            // An older firmware may not have it.
            Err(LinkError::Refused { .. }) => {}
            Err(error) => return Err(error.into()),
        }
    }
    Ok(kept)
}

/// Whether the stand has seen its index since it was switched on.
fn knows_index(link: &mut SerialLink) -> Result<bool, CliError> {
    for order in ["STReam:DECimation 1", "STReam:CHANnels from_index_rad", "STReam ON"] {
        link.command(order)?;
    }
    let seen = has_index(link, LOOK)?;
    link.command("STReam OFF")?;
    Ok(seen)
}
