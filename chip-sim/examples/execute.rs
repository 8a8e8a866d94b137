//! Executes single instructions with given registers, for `tests/compare_with_unicorn.py`; `execute --speed` measures instructions per
//! second.
//!
//! Input, one case a line, hexadecimal: steps, code bytes, R0 to R14, xPSR, S0 to S31, FPSCR.
//! Output: status, R15, R0 to R14, xPSR, S0 to S31, FPSCR, written bytes as address:value in the order of the addresses.
use chip_sim::cpu::{Bus, Core, Event, Width};
use std::collections::BTreeMap;
use std::io::{BufRead, Write};

const FLASH: u32 = 0x0800_0000;
const RAM: u32 = 0x2000_0000;
const REGION_BYTES: u32 = 0x1_0000;
const CODE: u32 = 0x0800_8000;

/// Two regions whose unwritten bytes are a function of the address, as in the Python script.
struct PatternMemory {
    written: BTreeMap<u32, u8>,
    code: Vec<u8>,
    outside: bool,
}

impl PatternMemory {
    fn byte(&self, address: u32) -> u8 {
        let code = self.code.get(address.wrapping_sub(CODE) as usize).copied();
        let pattern = ((address & !3).wrapping_mul(2_654_435_761) >> 3).to_le_bytes()[(address & 3) as usize];
        self.written.get(&address).copied().or(code).unwrap_or(pattern)
    }

    fn check(&mut self, address: u32, width: Width) {
        let inside = |start: u32| address.wrapping_sub(start) <= REGION_BYTES - width.bytes();
        self.outside |= !inside(FLASH) && !inside(RAM);
    }
}

impl Bus for PatternMemory {
    fn fetch(&mut self, address: u32) -> u16 {
        u16::from_le_bytes([self.byte(address), self.byte(address.wrapping_add(1))])
    }

    fn read(&mut self, address: u32, width: Width) -> u32 {
        self.check(address, width);
        (0..width.bytes()).fold(0, |value, k| value | u32::from(self.byte(address.wrapping_add(k))) << (8 * k))
    }

    fn write(&mut self, address: u32, width: Width, value: u32) {
        self.check(address, width);
        for k in 0..width.bytes() {
            self.written.insert(address.wrapping_add(k), (value >> (8 * k)) as u8);
        }
    }
}

/// Loop of loads, stores, arithmetic, a multiplication and a branch.
fn measure_speed() {
    struct Ram([u8; 4096]);
    impl Bus for Ram {
        #[inline(always)]
        fn fetch(&mut self, address: u32) -> u16 {
            let k = (address & 0xffe) as usize;
            u16::from_le_bytes([self.0[k], self.0[k + 1]])
        }
        #[inline(always)]
        fn read(&mut self, address: u32, width: Width) -> u32 {
            let k = (address & 0xffc) as usize;
            let word = u32::from_le_bytes([self.0[k], self.0[k + 1], self.0[k + 2], self.0[k + 3]]);
            if width == Width::Word { word } else { word & 0xff }
        }
        #[inline(always)]
        fn write(&mut self, address: u32, _: Width, value: u32) {
            let k = (address & 0xffc) as usize;
            self.0[k..k + 4].copy_from_slice(&value.to_le_bytes());
        }
    }
    // ldr r0,[r1,#4]; adds r0,#1; str r0,[r1,#4]; add.w r2,r2,r0,lsl #2; mul r3,r0,r2; vmul.f32 s0,s1,s2; cmp r0,#0; b start
    let code: [u16; 10] = [0x6848, 0x3001, 0x6048, 0xeb02, 0x0280, 0xfb00, 0xf302, 0xee20, 0x0a81, 0xe7f5];
    let mut memory = Ram([0; 4096]);
    for (k, half) in code.into_iter().enumerate() {
        memory.0[2 * k..2 * k + 2].copy_from_slice(&half.to_le_bytes());
    }
    let mut core = Core::reset(0x800, 0);
    core.r[1] = 0x900;
    let (start, steps) = (std::time::Instant::now(), 100_000_000u32);
    let cycles: u64 = (0..steps).map(|_| u64::from(core.step(&mut memory).unwrap_or(0))).sum();
    println!("{:.0} MIPS, {cycles} cycles", f64::from(steps) / start.elapsed().as_secs_f64() / 1e6);
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    if std::env::args().nth(1).as_deref() == Some("--speed") {
        measure_speed();
        return Ok(());
    }
    let mut output = std::io::BufWriter::new(std::io::stdout().lock());
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let mut fields = line.split_ascii_whitespace();
        let steps: u32 = fields.next().ok_or("steps missing")?.parse()?;
        let text = fields.next().ok_or("code missing")?;
        let code = (0..text.len() / 2).map(|k| u8::from_str_radix(&text[2 * k..2 * k + 2], 16)).collect::<Result<Vec<_>, _>>()?;
        let values = fields.map(|field| u32::from_str_radix(field, 16)).collect::<Result<Vec<_>, _>>()?;
        if values.len() != 49 {
            return Err(format!("{} values instead of 49 in: {line}", values.len()).into());
        }
        let mut core = Core::reset(0, CODE);
        core.r[..15].copy_from_slice(&values[..15]);
        core.set_xpsr(values[15]);
        core.s.copy_from_slice(&values[16..48]);
        core.fpscr = values[48];
        core.control = 4;
        let mut memory = PatternMemory { written: BTreeMap::new(), code, outside: false };
        let mut status = "ok";
        for _ in 0..steps {
            match core.step(&mut memory) {
                Ok(_) => {}
                Err(Event::Undefined(_)) => status = "undefined",
                Err(_) => status = "event",
            }
        }
        if memory.outside {
            status = "outside";
        }
        write!(output, "{status} {:x}", core.r[15])?;
        for value in core.r[..15].iter().chain([&core.xpsr()]).chain(&core.s).chain([&core.fpscr]) {
            write!(output, " {value:x}")?;
        }
        for (address, value) in &memory.written {
            write!(output, " {address:x}:{value:x}")?;
        }
        writeln!(output)?;
    }
    Ok(())
}
