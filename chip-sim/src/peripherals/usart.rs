//! USART2 (RM0390 §25): byte times from BRR, transmit buffer, overrun, framing error, break, idle line.

use crate::time::{NEVER, Time};
use std::collections::VecDeque;

const SR_FE: u32 = 1 << 1;
const SR_ORE: u32 = 1 << 3;
const SR_IDLE: u32 = 1 << 4;
const SR_RXNE: u32 = 1 << 5;
const SR_TC: u32 = 1 << 6;
const SR_TXE: u32 = 1 << 7;
const CR1_UE: u32 = 1 << 13;
const CR1_TE: u32 = 1 << 3;
const CR1_RE: u32 = 1 << 2;
/// Bits of a byte on the line: start, 8 data, stop.
const FRAME_BITS: Time = 10;
/// Relative error of the baud rate above which the receiver samples the wrong bits (RM0390 §25.4.5: 3.75 % with 8× to 16× oversampling).
const MAX_BAUD_ERROR: f64 = 0.035;

/// What arrives at the receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received {
    /// A byte, complete at its time.
    Byte(u8),
    /// A byte with a wrong stop bit.
    Damaged(u8),
    /// The line is low for longer than a frame.
    Break,
    /// The line has been high for a frame.
    Idle,
}

/// The transceiver.
pub struct Usart {
    sr: u32,
    dr: u8,
    brr: u32,
    cr: [u32; 3],
    gtpr: u32,
    shifting: Option<(u8, Time)>,
    waiting: Option<u8>,
    incoming: VecDeque<(Time, Received)>,
    /// Time and value of each transmitted byte that the host has not taken.
    pub transmitted: VecDeque<(Time, u8)>,
    /// Received bytes that nobody fetched in time.
    pub overruns: u64,
    /// Bytes that came while the receiver was off.
    pub ignored: u64,
    /// The receive line is held low (break).
    pub is_low: bool,
    /// Period of APB1.
    pub pclk: Time,
}

impl Default for Usart {
    fn default() -> Self {
        Self {
            sr: SR_TXE | SR_TC,
            dr: 0,
            brr: 0,
            cr: [0; 3],
            gtpr: 0,
            shifting: None,
            waiting: None,
            incoming: VecDeque::new(),
            transmitted: VecDeque::new(),
            overruns: 0,
            ignored: 0,
            is_low: false,
            pclk: 45,
        }
    }
}

impl Usart {
    /// Registers as after a reset; what is on the line, and the counters, stay.
    pub fn reset(&mut self) {
        *self = Self {
            incoming: std::mem::take(&mut self.incoming),
            transmitted: std::mem::take(&mut self.transmitted),
            overruns: self.overruns,
            ignored: self.ignored,
            is_low: self.is_low,
            pclk: self.pclk,
            ..Self::default()
        };
    }

    /// Time of a byte on the line, 16× oversampling.
    fn byte_time(&self) -> Time {
        FRAME_BITS * Time::from(self.brr.max(1)) * self.pclk
    }

    /// Next event of transmitter or receiver.
    #[inline]
    pub fn next(&self) -> Time {
        let sent = self.shifting.map_or(NEVER, |(_, end)| end);
        sent.min(self.incoming.front().map_or(NEVER, |(at, _)| *at))
    }

    /// The host sends `bytes` from `at` on at `baud`; returns the time after the last one.
    pub fn send(&mut self, at: Time, bytes: &[u8], baud: u64) -> Time {
        let byte = crate::time::PER_S * FRAME_BITS / baud.max(1);
        // A byte still on the line delays the next one; the idle event of the line before falls away.
        while self.incoming.back().is_some_and(|(_, what)| *what == Received::Idle) {
            self.incoming.pop_back();
        }
        let mut end = self.incoming.back().map_or(at, |(last, _)| at.max(*last));
        let mine = self.byte_time();
        let wrong = (byte as f64 / mine as f64 - 1.0).abs() > MAX_BAUD_ERROR;
        for value in bytes {
            end += byte;
            self.incoming.push_back((end, if wrong { Received::Damaged(value.rotate_left(3)) } else { Received::Byte(*value) }));
        }
        self.incoming.push_back((end + byte, Received::Idle));
        end
    }

    /// The host sends a break at `at`.
    pub fn send_break(&mut self, at: Time) {
        self.incoming.push_back((at + self.byte_time(), Received::Break));
    }

    /// Moves transmitter and receiver to `now`; returns whether a byte was received.
    pub fn advance(&mut self, now: Time) -> bool {
        while let Some((byte, end)) = self.shifting.filter(|(_, end)| *end <= now) {
            self.transmitted.push_back((end, byte));
            self.shifting = self.waiting.take().map(|next| (next, end + self.byte_time()));
            self.sr |= if self.shifting.is_some() { SR_TXE } else { SR_TC };
        }
        let mut got = false;
        if let Some((_, what)) = self.incoming.front().copied().filter(|(at, _)| *at <= now) {
            self.incoming.pop_front();
            self.receive(what);
            got = true;
        }
        got
    }

    fn receive(&mut self, what: Received) {
        self.is_low = what == Received::Break;
        if self.cr[0] & (CR1_UE | CR1_RE) != CR1_UE | CR1_RE {
            self.ignored += u64::from(matches!(what, Received::Byte(_) | Received::Damaged(_)));
            return;
        }
        let (byte, flag) = match what {
            Received::Idle => {
                self.sr |= SR_IDLE;
                return;
            }
            Received::Byte(byte) => (byte, 0),
            Received::Damaged(byte) => (byte, SR_FE),
            Received::Break => (0, SR_FE),
        };
        if self.sr & SR_RXNE != 0 {
            self.sr |= SR_ORE;
            self.overruns += 1;
        } else {
            self.dr = byte;
            self.sr |= SR_RXNE | flag;
        }
    }

    /// DMA requests of receiver and transmitter.
    pub fn requests_dma(&self) -> [bool; 2] {
        let receive = self.cr[2] & 1 << 6 != 0 && self.sr & SR_RXNE != 0;
        let transmit = self.cr[2] & 1 << 7 != 0 && self.sr & SR_TXE != 0 && self.cr[0] & (CR1_UE | CR1_TE) == CR1_UE | CR1_TE;
        [receive, transmit]
    }

    /// The interrupt line (RM0390, table 143).
    pub fn is_pending(&self) -> bool {
        // IDLEIE, RXNEIE, TCIE, TXEIE are bits 4 to 7, as their flags; ORE shares RXNEIE.
        self.sr & self.cr[0] & 0xF0 != 0
            || self.sr & SR_ORE != 0 && self.cr[0] & SR_RXNE != 0
            || self.sr & (SR_ORE | SR_FE | 4) != 0 && self.cr[2] & 1 != 0
    }

    /// A register; `None`: not modelled.
    pub fn read(&mut self, offset: u32) -> Option<u32> {
        Some(match offset {
            0x00 => self.sr,
            0x04 => {
                // SR then DR clears RXNE and the error flags (RM0390 §25.6.1).
                self.sr &= !0x3F;
                u32::from(self.dr)
            }
            0x08 => self.brr,
            0x0C..=0x14 => self.cr[(offset as usize - 0x0C) / 4],
            0x18 => self.gtpr,
            _ => return None,
        })
    }

    /// Writes a register; `None`: not modelled.
    pub fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        match offset {
            // Only RXNE and TC (and CTS, LBD, not modelled) are cleared by writing zero.
            0x00 => self.sr &= value | !(SR_RXNE | SR_TC),
            0x04 => {
                self.sr &= !SR_TC;
                if self.shifting.is_none() {
                    self.shifting = Some((value as u8, now + self.byte_time()));
                } else {
                    self.waiting = Some(value as u8);
                    self.sr &= !SR_TXE;
                }
            }
            0x08 => self.brr = value & 0xFFFF,
            // Half-duplex, LIN, smartcard and 8× oversampling are not modelled.
            0x0C if value & 1 << 15 != 0 => return None,
            0x0C..=0x14 => self.cr[(offset as usize - 0x0C) / 4] = value,
            0x18 => self.gtpr = value,
            _ => return None,
        }
        Some(())
    }
}
