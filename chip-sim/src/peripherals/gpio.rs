//! Ports A to D and H (RM0390 §7): modes, alternate functions, inputs from outside, outputs.

/// Ports in order of their addresses: A to H.
pub const PORTS: usize = 8;

/// One pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pin {
    /// 0: port A.
    pub port: u8,
    /// 0 to 15.
    pub number: u8,
}

/// Pin `number` of the port with this letter.
pub const fn pin(port: u8, number: u8) -> Pin {
    Pin { port: port - b'A', number }
}

/// A port's registers, and the levels that the board drives.
#[derive(Clone, Copy, Default)]
struct Port {
    moder: u32,
    otyper: u32,
    ospeedr: u32,
    pupdr: u32,
    odr: u32,
    lckr: u32,
    afr: [u32; 2],
    /// Level at each pin that something outside drives.
    outside: u32,
    driven: u32,
}

/// All ports.
pub struct Gpio {
    ports: [Port; PORTS],
}

impl Default for Gpio {
    fn default() -> Self {
        Self::new()
    }
}

impl Gpio {
    /// Ports after reset (RM0390 §7.4: the debug pins are alternate functions).
    pub fn new() -> Self {
        let mut ports = [Port::default(); PORTS];
        ports[0] = Port { moder: 0xA800_0000, pupdr: 0x6400_0000, ..Port::default() };
        ports[1] = Port { moder: 0x0000_0280, pupdr: 0x0000_0100, ..Port::default() };
        Self { ports }
    }

    /// Registers as after a reset; what the board drives stays.
    pub fn reset(&mut self) {
        let fresh = Self::new();
        for (port, fresh) in self.ports.iter_mut().zip(fresh.ports) {
            *port = Port { outside: port.outside, driven: port.driven, ..fresh };
        }
    }

    /// The board drives `pin` to this level.
    pub fn drive(&mut self, pin: Pin, high: bool) {
        let port = &mut self.ports[usize::from(pin.port)];
        port.driven |= 1 << pin.number;
        port.outside = port.outside & !(1 << pin.number) | u32::from(high) << pin.number;
    }

    /// Whether `pin` is the alternate function `function`.
    #[inline]
    pub fn is_alternate(&self, pin: Pin, function: u32) -> bool {
        let port = &self.ports[usize::from(pin.port)];
        let number = u32::from(pin.number);
        port.moder >> (2 * number) & 3 == 2 && port.afr[usize::from(pin.number / 8)] >> (4 * (number % 8)) & 15 == function
    }

    /// The level of an output; `None`: the pin is not an output, the line floats.
    pub fn output(&self, pin: Pin) -> Option<bool> {
        let port = &self.ports[usize::from(pin.port)];
        (port.moder >> (2 * u32::from(pin.number)) & 3 == 1).then_some(port.odr >> pin.number & 1 != 0)
    }

    fn levels(&self, index: usize) -> u32 {
        let port = &self.ports[index];
        (0..16).fold(0, |levels, bit| {
            let mode = port.moder >> (2 * bit) & 3;
            let level = match mode {
                // The Schmitt trigger is off in analog mode (RM0390 §7.3.12).
                3 => 0,
                1 => port.odr >> bit & 1,
                _ if port.driven >> bit & 1 != 0 => port.outside >> bit & 1,
                _ => u32::from(port.pupdr >> (2 * bit) & 3 == 1),
            };
            levels | level << bit
        })
    }

    /// A register of port `index`; `None`: not modelled.
    pub fn read(&self, index: usize, offset: u32) -> Option<u32> {
        let port = self.ports.get(index)?;
        Some(match offset {
            0x00 => port.moder,
            0x04 => port.otyper,
            0x08 => port.ospeedr,
            0x0C => port.pupdr,
            0x10 => self.levels(index),
            0x14 => port.odr,
            0x18 => 0, // write-only, reads as zero
            0x1C => port.lckr,
            0x20 => port.afr[0],
            0x24 => port.afr[1],
            _ => return None,
        })
    }

    /// Writes a register; `None`: not modelled.
    pub fn write(&mut self, index: usize, offset: u32, value: u32) -> Option<()> {
        let port = self.ports.get_mut(index)?;
        match offset {
            0x00 => port.moder = value,
            0x04 => port.otyper = value & 0xFFFF,
            0x08 => port.ospeedr = value,
            0x0C => port.pupdr = value,
            0x14 => port.odr = value & 0xFFFF,
            0x18 => port.odr = port.odr & !(value >> 16) | value & 0xFFFF,
            0x1C => port.lckr = value,
            0x20 => port.afr[0] = value,
            0x24 => port.afr[1] = value,
            0x10 => {}
            _ => return None,
        }
        Some(())
    }
}
