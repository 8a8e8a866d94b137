//! What can be wrong with a line, in words for the person at the bench.

/// Why there is no link, or no longer.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the words say it")]
pub enum LinkError {
    #[error("{port}: there is no such port ({there})")]
    Absent { port: String, there: String },
    #[error("{port}: this is no serial port")]
    NoPort { port: String },
    #[error("{port}: another program has this port; close it first")]
    RowOutcome { port: String },
    #[error("{port}: you may not open this port; it belongs to a group (often `dialout`) that you can be added to")]
    Denied { port: String },
    #[error("{port}: nobody answers; is the stand on, is this its port, and does it speak at {baud} baud?")]
    Silent { port: String, baud: u32 },
    #[error("{port}: what comes is no text of a stand; is this its port, and does it speak at {baud} baud?")]
    Garbled { port: String, baud: u32 },
    #[error("{port}: what answers is no stand: `{says}`")]
    Stranger { port: String, says: String },
    #[error("{port}: the line was unplugged")]
    Unplugged { port: String },
    #[error("{port}: {source}")]
    Other { port: String, source: std::io::Error },
    #[error("{port}: the stand does not answer `{query}`; if it stays so, send 0x18 (Ctrl-X) or switch it off and on")]
    NoReply { port: String, query: String },
    #[error("the stand refuses `{command}`: {says}")]
    Refused { command: String, says: String },
    #[error("`{command}` is too long: the stand takes {most} characters")]
    TooLong { command: String, most: usize },
}

impl LinkError {
    /// The words or the input are wrong, and not the line that broke: exit status 2.
    pub fn is_input_error(&self) -> bool {
        !matches!(self, LinkError::Unplugged { .. } | LinkError::Other { .. } | LinkError::NoReply { .. })
    }
}
