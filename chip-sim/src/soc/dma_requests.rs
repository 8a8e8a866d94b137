//! Request lines of the DMA controllers, and the transfers that they start.

use super::address_map::{AccessError, Block};
use super::{RAM, Soc};
use crate::peripherals::dma::{Item, STREAMS};

impl Soc {
    /// Whether a stream is requested by its line (RM0390, tables 28 and 29); the peripheral's request is then taken.
    fn takes_request(&mut self, controller: usize, stream: usize, channel: u32, to_peripheral: bool) -> bool {
        let [usart_receive, usart_transmit] = self.usart.requests_dma();
        let [spi_receive, spi_transmit] = self.spi.requests_dma();
        match (controller, stream, channel, to_peripheral) {
            (0, 3, 0, false) => spi_receive,
            (0, 4, 0, true) => spi_transmit,
            (0, 5, 4, false) => usart_receive,
            (0, 6, 4, true) => usart_transmit,
            (1, 0, 0, false) => self.adc.requests_dma(),
            // A timer's request ends with its transfer.
            (1, 1, 7, true) => self.tim8.take_dma_request(),
            _ => {
                self.fail(AccessError::DmaRequest { controller: controller + 1, stream, channel });
                false
            }
        }
    }

    pub(super) fn serve_dma(&mut self) {
        loop {
            let mut moved = false;
            for controller in 0..2 {
                for stream in 0..STREAMS {
                    let Some((channel, to_peripheral, _)) = self.dma[controller].request(stream) else { continue };
                    if self.takes_request(controller, stream, channel, to_peripheral) {
                        let item = self.dma[controller].take(stream);
                        self.move_item(item);
                        moved = true;
                    }
                }
            }
            if !moved {
                return;
            }
        }
    }

    fn move_item(&mut self, item: Item) {
        let Item { register, memory, bytes, to_peripheral } = item;
        let Some((block, offset)) = Block::of(register) else {
            return self.fail(AccessError::Unmapped { address: register, write: to_peripheral });
        };
        let start = memory.wrapping_sub(RAM) as usize;
        let Some(place) = self.ram.get_mut(start..start.saturating_add(bytes as usize)) else {
            return self.fail(AccessError::DmaMemory(memory));
        };
        if to_peripheral {
            let value = place.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte));
            self.write_block(block, offset, value);
        } else {
            let value = self.read_block(block, offset);
            let start = memory.wrapping_sub(RAM) as usize;
            for (k, byte) in self.ram[start..start + bytes as usize].iter_mut().enumerate() {
                *byte = (value >> (8 * k)) as u8;
            }
        }
    }
}
