//! Rows over the serial line, as a CSV log of interfaces.md.
//!
//! The measurement never waits for the line: rows go into a queue, and what finds it full is lost and counted; the
//! column `sequence` shows where.

use core::fmt::Write;
use embassy_stm32::mode::Async;
use embassy_stm32::usart::UartTx;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use heapless::String;
use stand_firmware::board::Hardware;
use stand_firmware::measurement_loop::{Row, RowSink};
use stand_firmware::profile::ProfileConfig;

/// Rows of the loop in one row of the line: 200 rows of at most 110 bytes a second are half of what it carries.
pub const EVERY: u32 = 5;

type Line = String<112>;
static LINES: Channel<CriticalSectionRawMutex, Line, 32> = Channel::new();

/// Sends what is in the queue, for ever.
#[embassy_executor::task]
pub async fn send(mut uart: UartTx<'static, Async>) {
    loop {
        let line = LINES.receive().await;
        if uart.write(line.as_bytes()).await.is_err() {
            defmt::warn!("the serial line failed to send a line");
        }
    }
}

/// Notes and the header of a log.
pub async fn header(hardware: &Hardware, profile: &ProfileConfig, mode: &str, from_index: bool) {
    note(format_args!("stand: NUCLEO-F446RE")).await;
    note(format_args!("firmware: {}", stand_firmware::VERSION)).await;
    note(format_args!("profile: {}", profile.kind)).await;
    note(format_args!("amplitude: {} rad/s", profile.amplitude)).await;
    note(format_args!("mode: {mode}")).await;
    note(format_args!("seed: {}", profile.seed)).await;
    note(format_args!("u_V: asked")).await;
    note(format_args!("i_A: mean of samples each 0.1 ms over [t, t+5 ms)")).await;
    note(format_args!("theta_zero: {}", if from_index { "index" } else { "arbitrary" })).await;
    note(format_args!("theta_lsb_rad: {:.9}", hardware.rad_per_count())).await;
    note(format_args!("rate_sensor: none")).await;
    let mut line = Line::new();
    if line.push_str("t_s,u_V,supply_V,i_A,theta_rad,rate_cmd_rad_s,theta_cmd_rad,temp_C,sequence,limits,fault\r\n").is_ok() {
        LINES.send(line).await;
    }
}

async fn note(words: core::fmt::Arguments<'_>) {
    let mut line = Line::new();
    if write!(line, "# {words}\r\n").is_ok() {
        LINES.send(line).await;
    }
}

/// The end of the measurement loop's rows that goes to the line.
#[derive(Default)]
pub struct Rows {
    lost: u32,
}

impl Rows {
    /// Rows that found the queue full.
    pub fn lost(&self) -> u32 {
        self.lost
    }
}

impl RowSink for Rows {
    fn row(&mut self, row: &Row) {
        let mut line = Line::new();
        let written = write_row(&mut line, row);
        if written.is_err() || LINES.try_send(line).is_err() {
            self.lost = self.lost.wrapping_add(1);
        }
    }
}

fn write_row(line: &mut Line, row: &Row) -> core::fmt::Result {
    write!(line, "{:.6},{:.5}", row.t_s, row.u_V)?;
    cell(line, row.supply_V, 3)?;
    cell(line, row.i_A, 5)?;
    write!(line, ",{:.6}", row.theta_rad)?;
    cell(line, row.rate_cmd_rad_s, 7)?;
    cell(line, row.theta_cmd_rad, 6)?;
    cell(line, row.temp_C, 2)?;
    write!(line, ",{},{},{}\r\n", row.sequence, row.limits.0, row.fault.name())
}

/// A value, or nothing where there is none.
fn cell(line: &mut Line, value: Option<f64>, digits: usize) -> core::fmt::Result {
    match value {
        Some(value) => write!(line, ",{value:.digits$}"),
        None => line.write_char(','),
    }
}
