//! A program at the other end of the simulated controller's line.

use hal_sim::board::linear_motor::LinearMotor;
use hal_sim::controller::Controller;
use stand_firmware::board::{Clock, TICKS_PER_S};

/// It asks and tells, and lets time pass.
pub struct Host<'h, 'c> {
    pub controller: &'h Controller<'c, LinearMotor>,
}

impl Host<'_, '_> {
    pub async fn wait_s(&self, seconds: f64) {
        let clock = self.controller.clock();
        clock.until(clock.now() + (seconds * TICKS_PER_S as f64) as u64).await;
    }

    /// What comes within 20 ms of a line; what came before is let go.
    pub async fn ask(&self, text: &str) -> String {
        let mut bytes = Vec::new();
        self.controller.line().receive(&mut bytes);
        bytes.clear();
        self.controller.line().send(format!("{text}\n").as_bytes());
        self.wait_s(0.02).await;
        self.controller.line().receive(&mut bytes);
        String::from_utf8(bytes).unwrap().trim_end().to_owned()
    }

    /// Says something that is taken.
    pub async fn tell(&self, text: &str) {
        assert_eq!(self.ask(&format!("{text};:SYST:ERR?")).await, "0,\"No error\"", "{text}");
    }
}
