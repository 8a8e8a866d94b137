//! Accesses to registers: of the peripherals through their clock gates, of the core, of the system memory.

use super::address_map::{AccessError, Block};
use super::{CORE, Soc};
use crate::cpu::Width;
use crate::peripherals::flash;
use crate::peripherals::rcc::ResetCause;
use crate::system_control::Request;

impl Soc {
    fn is_clocked(&mut self, block: Block, address: u32, write: bool) -> bool {
        let on = block.gate().is_none_or(|(offset, bit)| self.rcc.is_enabled(offset, bit));
        if !on {
            *self.gated.entry((address & !3, write)).or_default() += 1;
        }
        on
    }

    pub(super) fn read_block(&mut self, block: Block, offset: u32) -> u32 {
        let now = self.now;
        let value = match block {
            Block::Timer(index) => {
                self.board.catch_up(now);
                self.follow_encoder();
                let disc = self.board.disc();
                // Reading a capture clears its flag; the stand's timers raise no interrupt.
                self.timers[index].read(offset, now, disc)
            }
            Block::WindowWatchdog => self.window.read(offset, now),
            Block::IndependentWatchdog => self.watchdog.read(offset),
            Block::Spi2 => {
                let value = self.spi.read(offset);
                self.schedule();
                value
            }
            Block::Usart2 => {
                let value = self.usart.read(offset);
                self.schedule();
                value
            }
            Block::Pwr => match offset {
                0 => Some(self.pwr[0]),
                // Over-drive and regulator are ready at once; VOS is in force (RM0390 §5.4.2).
                4 => Some(self.pwr[1] | self.pwr[0] & 0x3_0000 | 1 << 14),
                _ => None,
            },
            Block::Dac => self.dac.read(offset),
            Block::Tim1 => self.tim1.read(offset, now),
            Block::Tim8 => self.tim8.read(offset, now),
            Block::Adc => self.adc.read(offset),
            Block::SysCfg => self.syscfg.get(offset as usize / 4).copied(),
            Block::Exti => self.exti.get(offset as usize / 4).copied(),
            Block::Gpio(index) => self.gpio.read(index, offset),
            Block::Rcc => self.rcc.read(offset, now),
            Block::FlashInterface => self.flash.read(offset),
            Block::Dma(index) => self.dma[index].read(offset),
        };
        value.unwrap_or_else(|| {
            self.fail(AccessError::NotModelled { peripheral: block.name(), offset, write: false, value: None });
            0
        })
    }

    pub(super) fn write_block(&mut self, block: Block, offset: u32, value: u32) {
        let now = self.now;
        let done = match block {
            Block::Timer(index) => {
                self.board.catch_up(now);
                self.follow_encoder();
                let disc = self.board.disc();
                self.timers[index].write(offset, value, now, disc)
            }
            Block::WindowWatchdog => self.window.write(offset, value, now).map(|early| {
                if early {
                    self.reset = Some(ResetCause::WindowWatchdog);
                }
            }),
            Block::IndependentWatchdog => self.watchdog.write(offset, value, now),
            Block::Spi2 => self.spi.write(offset, value, now),
            Block::Usart2 => self.usart.write(offset, value, now),
            Block::Pwr => self.pwr.get_mut(offset as usize / 4).map(|word| *word = value),
            Block::Dac => self.dac.write(offset, value, now),
            Block::Tim1 => {
                let done = self.tim1.write(offset, value, now);
                // Only these change the outputs at once; compare values wait for the update event.
                if !matches!(offset, 0x10 | 0x34..=0x40) {
                    self.follow_bridge();
                }
                done
            }
            Block::Tim8 => self.tim8.write(offset, value, now),
            Block::Adc => self.adc.write(offset, value),
            Block::SysCfg => self.syscfg.get_mut(offset as usize / 4).map(|word| *word = value),
            // Only the masks and edge selections are stored: the stand uses no external interrupt; a software interrupt is not modelled.
            Block::Exti if offset < 0x10 => self.exti.get_mut(offset as usize / 4).map(|word| *word = value),
            Block::Exti if offset == 0x14 => Some(()),
            Block::Exti => None,
            Block::Gpio(index) => {
                let done = self.gpio.write(index, offset, value);
                self.follow_pins(index);
                done
            }
            Block::Rcc => {
                let done = self.rcc.write(offset, value, now);
                self.reset_peripherals(offset, value);
                self.control.set_nmi(self.rcc.has_failed());
                self.follow_clocks();
                done
            }
            Block::FlashInterface => self.flash.write(offset, value, now).map(|stall| self.stall(stall)),
            Block::Dma(index) => self.dma[index].write(offset, value),
        };
        if done.is_none() {
            self.fail(AccessError::NotModelled { peripheral: block.name(), offset, write: true, value: Some(value) });
        }
    }

    #[cold]
    fn read_system_memory(&mut self, address: u32) -> u32 {
        match address {
            // Unique identifier and flash size (RM0390 §34).
            0x1FFF_7A10 => 0x0012_0034,
            0x1FFF_7A14 => 0x3436_510D,
            0x1FFF_7A18 => 0x3730_3832,
            0x1FFF_7A20 => (flash::BYTES as u32 / 1024) << 16 | 0xFFFF,
            _ => {
                self.fail(AccessError::Unmapped { address, write: false });
                0
            }
        }
    }

    pub(super) fn read_register(&mut self, address: u32, width: Width) -> u32 {
        let word = if address >= CORE {
            match self.control.read(address & !3, self.cycles) {
                Some(value) => value,
                None => {
                    self.fail(AccessError::NotModelled { peripheral: "core", offset: address, write: false, value: None });
                    0
                }
            }
        } else if (0x1FFF_0000..0x2000_0000).contains(&address) {
            self.read_system_memory(address & !3)
        } else {
            match Block::of(address & !3) {
                None => {
                    self.fail(AccessError::Unmapped { address, write: false });
                    0
                }
                Some((block, _)) if !self.is_clocked(block, address, false) => 0,
                Some((block, offset)) => self.read_block(block, offset),
            }
        };
        match width {
            Width::Word => word,
            Width::Half => word >> (8 * (address & 2)) & 0xFFFF,
            Width::Byte => word >> (8 * (address & 3)) & 0xFF,
        }
    }

    pub(super) fn write_register(&mut self, address: u32, width: Width, value: u32) {
        if address >= CORE {
            match self.control.write(address, width.bytes(), value, self.cycles) {
                Some(Request::None) => {}
                Some(Request::Reset) => self.reset = Some(ResetCause::Software),
                None => self.fail(AccessError::NotModelled { peripheral: "core", offset: address, write: true, value: Some(value) }),
            }
            return;
        }
        match Block::of(address & !3) {
            None => self.fail(AccessError::Unmapped { address, write: true }),
            Some((block, _)) if !self.is_clocked(block, address, true) => {}
            Some((block, offset)) => {
                // APB registers are written as words: a narrow access is repeated on the other lanes (RM0390 §2.1); data registers take it
                // as it is.
                let narrow = match width {
                    Width::Word => value,
                    Width::Half => value & 0xFFFF,
                    Width::Byte => value & 0xFF,
                };
                self.write_block(block, offset, narrow << (8 * (address & 3)));
                self.serve_dma();
                self.schedule();
            }
        }
    }
}
