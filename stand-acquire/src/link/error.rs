//! Errors of the serial line.

use stand_firmware::telemetry::message::PROTOCOL;

/// Why a link could not be opened, or broke.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
pub enum LinkError {
    #[error("{port}: no such port ({available})")]
    Absent { port: String, available: String },
    #[error("{port}: not a serial port")]
    NotAPort { port: String },
    #[error("{port}: another program uses this port; close that program first")]
    InUse { port: String },
    #[error("{port}: no permission to open this port; add your user to its group (often `dialout`)")]
    Denied { port: String },
    #[error("{port}: no reply; check that the stand is on, that this is its port, and that its line runs at {baud} baud")]
    Silent { port: String, baud: u32 },
    #[error("{port}: the received data are not text of a stand; check that this is its port and that its line runs at {baud} baud")]
    Garbled { port: String, baud: u32 },
    #[error("{port}: the connected device is not a stand; it replied `{reply}`")]
    NotAStand { port: String, reply: String },
    #[error(
        "{port}: the stand streams in version {stand} of the protocol, this program reads version {PROTOCOL}; use the program and the firmware of one release"
    )]
    OtherProtocol { port: String, stand: u8 },
    #[error("{port}: the port was unplugged or closed")]
    Unplugged { port: String },
    #[error("{port}: {source}")]
    Other { port: String, source: std::io::Error },
    #[error("{port}: no reply to `{query}`; if this persists, send 0x18 (Ctrl-X) or switch the stand off and on")]
    NoReply { port: String, query: String },
    #[error("{port}: interrupted by a signal")]
    Interrupted { port: String },
    #[error("the stand rejected `{command}`: {message}")]
    Rejected { command: String, message: String },
    #[error("`{command}` is too long: the stand accepts {limit} characters")]
    TooLong { command: String, limit: usize },
}

impl LinkError {
    /// The cause is a wrong argument or setting, not a failure of the line.
    pub fn is_input_error(&self) -> bool {
        !matches!(self, LinkError::Unplugged { .. } | LinkError::Other { .. } | LinkError::NoReply { .. } | LinkError::Interrupted { .. })
    }
}
