//! The chip's address map: which peripheral has a register, its name, its clock gate; and the accesses that the chip cannot make.

/// An access that the chip cannot make.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AccessError {
    /// Nothing is at this address.
    #[error("{} at {address:#010x}: no memory there", verb(*.write))]
    Unmapped {
        /// The address.
        address: u32,
        /// A write, else a read.
        write: bool,
    },
    /// The peripheral has the register, but the simulated chip has not.
    #[error("{} of {peripheral} at offset {offset:#x}{}: not modelled", verb(*.write), value.map_or(String::new(), |v| format!(", value {v:#010x}")))]
    NotModelled {
        /// Name of the peripheral.
        peripheral: &'static str,
        /// Offset of the register.
        offset: u32,
        /// A write, else a read.
        write: bool,
        /// The written value.
        value: Option<u32>,
    },
    /// Flash that is locked or not in programming mode.
    #[error("write to locked flash at {0:#010x}")]
    LockedFlash(u32),
    /// A region that the MPU protects, such as the guard below the stack.
    #[error("{} at {address:#010x}: forbidden by the MPU", verb(*.write))]
    Forbidden {
        /// The address.
        address: u32,
        /// A write, else a read.
        write: bool,
    },
    /// A DMA stream is enabled for a request that the chip does not have, or that is not modelled.
    #[error("DMA{controller} stream {stream}: channel {channel} is not a modelled request")]
    DmaRequest {
        /// 1 or 2.
        controller: usize,
        /// Stream.
        stream: usize,
        /// Channel.
        channel: u32,
    },
    /// A DMA address outside the RAM.
    #[error("DMA at {0:#010x}: no memory there")]
    DmaMemory(u32),
}

fn verb(write: bool) -> &'static str {
    if write { "write" } else { "read" }
}

/// A peripheral of the address map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Block {
    Timer(usize),
    WindowWatchdog,
    IndependentWatchdog,
    Spi2,
    Usart2,
    Pwr,
    Dac,
    Tim1,
    Tim8,
    Adc,
    SysCfg,
    Exti,
    Gpio(usize),
    Rcc,
    FlashInterface,
    Dma(usize),
}

impl Block {
    pub(super) fn of(address: u32) -> Option<(Self, u32)> {
        let (block, base) = match address & !0x3FF {
            base @ (0x4000_0000 | 0x4000_0400 | 0x4000_0800 | 0x4000_0C00) => (Self::Timer((base >> 10 & 3) as usize), base),
            base @ 0x4000_2C00 => (Self::WindowWatchdog, base),
            base @ 0x4000_3000 => (Self::IndependentWatchdog, base),
            base @ 0x4000_3800 => (Self::Spi2, base),
            base @ 0x4000_4400 => (Self::Usart2, base),
            base @ 0x4000_7000 => (Self::Pwr, base),
            base @ 0x4000_7400 => (Self::Dac, base),
            base @ 0x4001_0000 => (Self::Tim1, base),
            base @ 0x4001_0400 => (Self::Tim8, base),
            base @ 0x4001_2000 => (Self::Adc, base),
            base @ 0x4001_3800 => (Self::SysCfg, base),
            base @ 0x4001_3C00 => (Self::Exti, base),
            base @ 0x4002_0000..=0x4002_1C00 => (Self::Gpio((base >> 10 & 7) as usize), base),
            base @ 0x4002_3800 => (Self::Rcc, base),
            base @ 0x4002_3C00 => (Self::FlashInterface, base),
            base @ (0x4002_6000 | 0x4002_6400) => (Self::Dma((base >> 10 & 1) as usize), base),
            _ => return None,
        };
        Some((block, address - base))
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Timer(index) => ["TIM2", "TIM3", "TIM4", "TIM5"][index],
            Self::WindowWatchdog => "WWDG",
            Self::IndependentWatchdog => "IWDG",
            Self::Spi2 => "SPI2",
            Self::Usart2 => "USART2",
            Self::Pwr => "PWR",
            Self::Dac => "DAC",
            Self::Tim1 => "TIM1",
            Self::Tim8 => "TIM8",
            Self::Adc => "ADC",
            Self::SysCfg => "SYSCFG",
            Self::Exti => "EXTI",
            Self::Gpio(index) => ["GPIOA", "GPIOB", "GPIOC", "GPIOD", "GPIOE", "GPIOF", "GPIOG", "GPIOH"][index],
            Self::Rcc => "RCC",
            Self::FlashInterface => "FLASH",
            Self::Dma(0) => "DMA1",
            Self::Dma(_) => "DMA2",
        }
    }

    /// Offset and bit of the clock gate in RCC (RM0390 §6.3); `None`: always on.
    pub(super) fn gate(self) -> Option<(u32, u32)> {
        Some(match self {
            Self::Timer(index) => (0x40, index as u32),
            Self::WindowWatchdog => (0x40, 11),
            Self::Spi2 => (0x40, 14),
            Self::Usart2 => (0x40, 17),
            Self::Pwr => (0x40, 28),
            Self::Dac => (0x40, 29),
            Self::Tim1 => (0x44, 0),
            Self::Tim8 => (0x44, 1),
            Self::Adc => (0x44, 8),
            Self::SysCfg => (0x44, 14),
            Self::Gpio(index) => (0x30, index as u32),
            Self::Dma(index) => (0x30, 21 + index as u32),
            Self::IndependentWatchdog | Self::Exti | Self::Rcc | Self::FlashInterface => return None,
        })
    }
}
