//! Text of the demonstration: the residual of each model, and the file of the simulated stand.

use hal_sim::plant::Stand;

use super::explanation::words;
use super::{significant, unit};
use identification::identify::explain::Explanation;
use identification::identify::fit::FitResult;
use identification::log::Axis;

/// One line for each channel: rms residual of the nominal model (if there is one), rms residual of each stage of the explanation, and
/// noise.
pub fn residual_table(nominal: &FitResult, explanation: &Explanation) -> String {
    let number = |x: f64| significant(x, 3);
    let mut header = vec!["".to_owned()];
    header.push("data sheet".to_owned());
    header.extend(explanation.stages.iter().map(|s| if s.added.is_none() { "fitted".to_owned() } else { words::stage(s) }));
    header.push("noise".to_owned());
    let mut rows = vec![header];
    for (k, output) in explanation.stages.first().map_or(&[][..], |s| &s.outputs).iter().enumerate() {
        let mut row = vec![format!("{}, {}", output.channel.column(), unit(Axis::Rotary, output.channel))];
        row.extend(nominal.channels.iter().find(|c| c.channel == output.channel).map(|c| number(c.rms)));
        row.extend(explanation.stages.iter().filter_map(|s| s.outputs.get(k)).map(|o| number(o.rms)));
        row.extend(explanation.stages.last().and_then(|s| s.outputs.get(k)).map(|o| number(o.noise)));
        rows.push(row);
    }
    let width = |k: usize| rows.iter().filter_map(|r| r.get(k)).map(|c| c.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for row in &rows {
        let cells: Vec<String> = row.iter().enumerate().map(|(k, cell)| format!("{cell:<width$}", width = width(k))).collect();
        text.push_str(&format!("   {}\n", cells.join("   ").trim_end()));
    }
    text
}

/// The effects of the simulated stand as a file for `--stand`.
pub fn stand_file(stand: &Stand) -> String {
    let mut text = String::from("# The default stand with the hidden effect of the demonstration.\n");
    for (name, parameters) in &stand.effects {
        text.push_str(&format!("\n[effects.{name}]\n"));
        for (parameter, value) in parameters {
            text.push_str(&format!("{parameter} = {value:?}\n"));
        }
    }
    text
}
