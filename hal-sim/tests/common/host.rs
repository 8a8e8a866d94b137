//! A host program at the serial line of the simulated controller.

use hal_sim::controller::Controller;
use stand_firmware::board::{Clock, TICKS_PER_S};

/// Sends commands and queries, and waits in virtual time.
pub struct Host<'h, 'c> {
    pub controller: &'h Controller<'c>,
}

impl Host<'_, '_> {
    pub async fn wait_s(&self, seconds: f64) {
        let clock = self.controller.clock();
        clock.until(clock.now() + (seconds * TICKS_PER_S as f64) as u64).await;
    }

    /// Sends a line and returns the reply of the next 20 ms; earlier output is discarded.
    pub async fn query(&self, text: &str) -> String {
        let mut bytes = Vec::new();
        self.controller.line().receive(&mut bytes);
        bytes.clear();
        self.controller.line().send(format!("{text}\n").as_bytes());
        self.wait_s(0.02).await;
        self.controller.line().receive(&mut bytes);
        String::from_utf8(bytes).unwrap().trim_end().to_owned()
    }

    /// Sends a command that must be accepted.
    pub async fn command(&self, text: &str) {
        assert_eq!(self.query(&format!("{text};:SYST:ERR?")).await, "0,\"No error\"", "{text}");
    }
}
