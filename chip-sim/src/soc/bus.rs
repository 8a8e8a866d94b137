//! The core's bus: RAM, flash, registers.

use super::address_map::AccessError;
use super::{PERIPHERALS, RAM, RAM_BYTES, Soc};
use crate::cpu::{Bus, Width};
use crate::peripherals::flash;

/// Halfword that no core executes: permanently undefined (DDI 0403E A7.7.194).
const UNDEFINED: u16 = 0xDE00;
impl Soc {
    fn flash_offset(address: u32) -> Option<usize> {
        let offset = address & !flash::BASE;
        ((address | flash::BASE) & !0x07_FFFF == flash::BASE && (offset as usize) < flash::BYTES).then_some(offset as usize)
    }
}

impl Bus for Soc {
    #[inline]
    fn fetch(&mut self, address: u32) -> u16 {
        if let Some(offset) = Self::flash_offset(address) {
            self.wait_for_line(address);
            let bytes = self.flash.bytes();
            return match bytes.get(offset..offset + 2) {
                Some(&[low, high]) => u16::from_le_bytes([low, high]),
                _ => UNDEFINED,
            };
        }
        let offset = address.wrapping_sub(RAM) as usize;
        match self.ram.get(offset..offset.saturating_add(2)) {
            Some(&[low, high]) => u16::from_le_bytes([low, high]),
            _ => {
                self.fail(AccessError::Unmapped { address, write: false });
                UNDEFINED
            }
        }
    }

    #[inline]
    fn read(&mut self, address: u32, width: Width) -> u32 {
        let offset = address.wrapping_sub(RAM) as usize;
        let length = width.bytes() as usize;
        let bytes = if offset < RAM_BYTES as usize {
            if self.control.forbids(address) {
                self.fail(AccessError::Forbidden { address, write: false });
            }
            self.ram.get(offset..offset + length)
        } else if let Some(offset) = Self::flash_offset(address) {
            self.wait_for_data(address);
            self.flash.bytes().get(offset..offset + length)
        } else {
            return self.read_register(address, width);
        };
        match bytes {
            Some(&[a]) => u32::from(a),
            Some(&[a, b]) => u32::from(u16::from_le_bytes([a, b])),
            Some(&[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]),
            _ => {
                self.fail(AccessError::Unmapped { address, write: false });
                0
            }
        }
    }

    #[inline]
    fn write(&mut self, address: u32, width: Width, value: u32) {
        let offset = address.wrapping_sub(RAM) as usize;
        let length = width.bytes() as usize;
        if offset < RAM_BYTES as usize {
            if self.control.forbids(address) {
                return self.fail(AccessError::Forbidden { address, write: true });
            }
            match self.ram.get_mut(offset..offset + length) {
                Some(place) => place.copy_from_slice(&value.to_le_bytes()[..length]),
                None => self.fail(AccessError::Unmapped { address, write: true }),
            }
        } else if Self::flash_offset(address).is_some() && address >= flash::BASE {
            match self.flash.program(address, &value.to_le_bytes()[..length]) {
                Some(stall) => self.stall(stall),
                None => self.fail(AccessError::LockedFlash(address)),
            }
        } else if address >= PERIPHERALS {
            self.write_register(address, width, value);
        } else {
            self.fail(AccessError::Unmapped { address, write: true });
        }
    }
}
