//! The registers of the chip: addresses, values after power-on, writable bits (DS13012 §9).

/// Standard gravity, m/s².
pub(super) const G_M_S2: f64 = 9.806_65;

/// Registers by their address.
pub(super) mod address {
    pub const FIFO_CTRL3: u8 = 0x09;
    pub const FIFO_CTRL4: u8 = 0x0A;
    pub const WHO_AM_I: u8 = 0x0F;
    pub const CTRL1_XL: u8 = 0x10;
    pub const CTRL2_G: u8 = 0x11;
    pub const CTRL3_C: u8 = 0x12;
    pub const CTRL4_C: u8 = 0x13;
    pub const CTRL5_C: u8 = 0x14;
    pub const CTRL6_C: u8 = 0x15;
    pub const CTRL8_XL: u8 = 0x17;
    pub const CTRL10_C: u8 = 0x19;
    pub const STATUS: u8 = 0x1E;
    pub const OUT_TEMP_L: u8 = 0x20;
    pub const OUTX_L_G: u8 = 0x22;
    pub const OUTZ_H_A: u8 = 0x2D;
    pub const FIFO_STATUS1: u8 = 0x3A;
    pub const FIFO_STATUS2: u8 = 0x3B;
    pub const TIMESTAMP0: u8 = 0x40;
    pub const TIMESTAMP2: u8 = 0x42;
    pub const TIMESTAMP3: u8 = 0x43;
    pub const INTERNAL_FREQ_FINE: u8 = 0x63;
    pub const FIFO_TAG: u8 = 0x78;
    pub const FIFO_Z_H: u8 = 0x7E;
}
use address::*;

/// Value of WHO_AM_I.
pub(super) const ID: u8 = 0x6B;

/// Writable registers: address, value after power-on, writable bits.
const KEPT: [(u8, u8, u8); 18] = [
    (0x01, 0x00, 0xC0), // FUNC_CFG_ACCESS
    (0x02, 0x3F, 0xC0), // PIN_CTRL
    (0x07, 0x00, 0xFF), // FIFO_CTRL1
    (0x08, 0x00, 0xD7), // FIFO_CTRL2
    (FIFO_CTRL3, 0x00, 0xFF),
    (FIFO_CTRL4, 0x00, 0xF7),
    (0x0D, 0x00, 0xFF), // INT1_CTRL
    (0x0E, 0x00, 0x7F), // INT2_CTRL
    (CTRL1_XL, 0x00, 0xFE),
    (CTRL2_G, 0x00, 0xFF),
    (CTRL3_C, 0x04, 0xFD),
    (CTRL4_C, 0x00, 0x6E),
    (CTRL5_C, 0x00, 0x6F),
    (CTRL6_C, 0x00, 0xFF),
    (0x16, 0x00, 0xFA), // CTRL7_G
    (CTRL8_XL, 0x00, 0xFD),
    (0x18, 0xE0, 0xFE), // CTRL9_XL
    (CTRL10_C, 0x00, 0x20),
];

/// The writable registers.
#[derive(Clone, Debug)]
pub(super) struct Registers([u8; KEPT.len()]);

impl Registers {
    pub fn after_power_on() -> Self {
        Self(KEPT.map(|(_, value, _)| value))
    }

    /// Value of a register; `None` where it is not writable.
    pub fn read(&self, address: u8) -> Option<u8> {
        KEPT.iter().zip(&self.0).find(|((at, ..), _)| *at == address).map(|(_, value)| *value)
    }

    /// Writes a register; false where it is not writable.
    pub fn write(&mut self, address: u8, value: u8) -> bool {
        let Some(((_, _, mask), kept)) = KEPT.iter().zip(&mut self.0).find(|((at, ..), _)| *at == address) else { return false };
        *kept = *kept & !mask | value & mask;
        true
    }

    fn at(&self, address: u8) -> u8 {
        self.read(address).unwrap_or(0)
    }

    /// Divider of the highest rate (6667 Hz) for the samples of gyroscope and accelerometer; `None`: off.
    pub fn divided(&self) -> [Option<u32>; 2] {
        [CTRL2_G, CTRL1_XL].map(|address| divided(self.at(address) >> 4))
    }

    /// Dividers of the samples in the FIFO.
    pub fn batched(&self) -> [Option<u32>; 2] {
        let ctrl3 = self.at(FIFO_CTRL3);
        [divided(ctrl3 >> 4), divided(ctrl3 & 15)]
    }

    /// rad/s and m/s² per code (DS13012, table 2).
    pub fn scales(&self) -> [f64; 2] {
        let ctrl2 = self.at(CTRL2_G);
        let mdps = match (ctrl2 & 1, ctrl2 >> 1 & 1, ctrl2 >> 2 & 3) {
            (1, ..) => 140.0,
            (_, 1, _) => 4.375,
            (.., range) => 8.75 * f64::from(1_u32 << range),
        };
        let mg = [0.061, 0.488, 0.122, 0.244][usize::from(self.at(CTRL1_XL) >> 2 & 3)];
        [(mdps * 1e-3_f64).to_radians(), mg * 1e-3 * G_M_S2]
    }

    /// Cutoffs of gyroscope and accelerometer, Hz: table 60 and table 65; without the low-pass half of the output rate.
    pub fn cutoffs_Hz(&self) -> [f64; 2] {
        const LPF1: [f64; 10] = [4.2, 8.3, 16.6, 33.0, 67.0, 136.6, 239.2, 304.2, 328.5, 335.5];
        let [gyro, accel] = [CTRL2_G, CTRL1_XL].map(|address| usize::from(self.at(address) >> 4).clamp(1, 10));
        let half_Hz = |code: usize| 0.5 * FASTEST_HZ / f64::from(1_u32 << (10 - code));
        let parts = [4.0, 10.0, 20.0, 45.0, 100.0, 200.0, 400.0, 800.0];
        let slow = self.at(CTRL1_XL) & 2 != 0;
        let part = parts[usize::from(self.at(CTRL8_XL) >> 5)];
        [
            if self.at(CTRL4_C) & 2 != 0 { LPF1[gyro - 1] } else { half_Hz(gyro) },
            if slow { 2.0 * half_Hz(accel) / part } else { half_Hz(accel) },
        ]
    }

    /// Active self-tests, gyroscope and accelerometer: +1, −1, or 0.
    pub fn tests(&self) -> [f64; 2] {
        let ctrl5 = self.at(CTRL5_C);
        let sign = |bits: u8, negative: u8| {
            if bits == 1 {
                1.0
            } else if bits == negative {
                -1.0
            } else {
                0.0
            }
        };
        [sign(ctrl5 >> 2 & 3, 3), sign(ctrl5 & 3, 2)]
    }

    pub fn stamps(&self) -> bool {
        self.at(CTRL10_C) & 0x20 != 0
    }

    /// Number of sampling times per time stamp in the FIFO; `None`: no time stamps.
    pub fn stamp_every(&self) -> Option<u32> {
        [None, Some(1), Some(8), Some(32)][usize::from(self.at(FIFO_CTRL4) >> 6)]
    }

    pub fn fifo_mode(&self) -> u8 {
        self.at(FIFO_CTRL4) & 7
    }

    /// Both bytes of an output belong together, even if a new sample arrives in between.
    pub fn block_data_update(&self) -> bool {
        self.at(CTRL3_C) & 0x40 != 0
    }

    /// A burst increments the register.
    pub fn increments(&self) -> bool {
        self.at(CTRL3_C) & 4 != 0
    }
}

/// Highest output rate of the chip, Hz.
pub(super) const FASTEST_HZ: f64 = 6667.0;

fn divided(code: u8) -> Option<u32> {
    (1..=10).contains(&code).then(|| 1 << (10 - code))
}
