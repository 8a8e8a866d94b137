//! `stand schema`: the JSON schemas of the answers that `--json` writes.

use clap::Args;
use serde_json::{Map, Value};

use super::console::Exchange;
use super::error::CliError;
use super::output;
use identification::words::nearest;
use stand_report::json::schema_of;
use stand_report::schema::all;

/// Print the JSON schemas of the answers that --json writes.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    stand schema > schemas.json     # all, by command\n  \
    stand schema explain            # one")]
pub(super) struct SchemaCommand {
    /// The command, e.g. observer design; without it the schemas of all commands, by command
    #[arg(value_name = "COMMAND")]
    command: Vec<String>,
}

impl SchemaCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        let mut schemas = all();
        schemas.push(("console", schema_of::<Vec<Exchange>>()));
        let wanted = self.command.join(" ");
        let printed = if wanted.is_empty() {
            Value::Object(schemas.into_iter().map(|(command, schema)| (command.to_owned(), schema)).collect::<Map<_, _>>())
        } else {
            let names = schemas.iter().map(|(command, _)| *command).collect::<Vec<_>>();
            let unknown = || {
                let advice = nearest(&wanted, names.iter().copied())
                    .map_or_else(|| format!("there are: {}", names.join("; ")), |near| format!("did you mean `{near}`?"));
                CliError::Input(format!("no answer `{wanted}`; {advice}"))
            };
            let found = schemas.iter().find(|(command, _)| *command == wanted);
            found.map(|(_, schema)| schema.clone()).ok_or_else(unknown)?
        };
        output::print(&format!("{printed:#}\n"))
    }
}
