//! `stand certificate`: a certificate from a calibration record and the details that no log contains.

use std::path::PathBuf;

use clap::Args;

use super::error::CliError;
use super::output::{JsonOutput, Overwrite, spinner, write};
use stand_records::archive::ArchivedRecord;
use stand_records::certificate::{Certificate, CertificateDetails, CertificateError, example};
use stand_report::certificate as report;

/// Write a certificate of a calibration: a page for print, and a Digital Calibration Certificate
#[derive(Debug, Args)]
#[command(after_help = "The certificate is never called accredited. `--write-details` writes an example of the details.")]
pub(super) struct CertificateCommand {
    /// A file record.json, or the folder of a session
    #[arg(required_unless_present = "write_details")]
    record: Option<PathBuf>,
    /// Laboratory, customer, item, ambient conditions, equipment, decision rule, signatory (TOML)
    #[arg(long, value_name = "FILE", required_unless_present = "write_details")]
    details: Option<PathBuf>,
    /// Write an example of the details to this file for editing, and exit
    #[arg(long, value_name = "FILE", conflicts_with_all = ["record", "details", "html", "dcc"])]
    write_details: Option<PathBuf>,
    /// Write the certificate as a page for print
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Write the Digital Calibration Certificate (XML, schema 3.3.0 of PTB)
    #[arg(long, value_name = "FILE")]
    dcc: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
    #[command(flatten)]
    json: JsonOutput,
}

impl CertificateCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.json.check()?;
        if let Some(path) = &self.write_details {
            self.overwrite.check(path)?;
            write(path, &example(&identification::log::timestamp()[..10]))?;
            return self.json.text(&format!("{}: example of the details of a certificate\n", path.display()));
        }
        let (Some(record), Some(details)) = (&self.record, &self.details) else {
            return Err(CliError::Input("certificate: a record and --details are needed".into()));
        };
        if self.html.is_none() && self.dcc.is_none() {
            return Err(CliError::Input("certificate: --html FILE, --dcc FILE, or both are needed".into()));
        }
        for path in self.html.iter().chain(&self.dcc) {
            self.overwrite.check(path)?;
        }
        let text = std::fs::read_to_string(details).map_err(|e| CliError::file(details, "read", &e))?;
        let parsed = CertificateDetails::parse(&text).map_err(|e| CliError::in_file(details, e))?;
        let archived = ArchivedRecord::read(record)?;
        let as_found = parsed.adjustment.as_found.as_deref().map(ArchivedRecord::read).transpose()?;
        let bar = spinner("recomputing from the raw logs");
        let verification = archived.verify();
        bar.finish_and_clear();
        let path = archived.path.clone();
        let certificate = Certificate::new(parsed, archived.record, &verification, as_found.map(|a| a.record)).map_err(|e| {
            let of_details = matches!(e, CertificateError::Field { .. });
            CliError::in_file(if of_details { details } else { &path }, e)
        })?;
        if let Some(path) = &self.html {
            write(path, &report::html(&certificate))?;
            self.json.text(&format!("{}: certificate {}\n", path.display(), certificate.details.number))?;
        }
        if let Some(path) = &self.dcc {
            write(path, &report::dcc(&certificate))?;
            self.json.text(&format!("{}: Digital Calibration Certificate {}\n", path.display(), certificate.details.number))?;
        }
        self.json.json(|| report::json(&certificate))
    }
}
