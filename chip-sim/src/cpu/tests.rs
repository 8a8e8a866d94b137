//! Known answers, one test per group of encodings.
use super::{Bus, Core, Event, Width};

const STACK: u32 = 0x800;

/// 4 KiB of memory that repeats.
struct Ram([u8; 4096]);

impl Bus for Ram {
    fn fetch(&mut self, address: u32) -> u16 {
        self.read(address, Width::Half) as u16
    }
    fn read(&mut self, address: u32, width: Width) -> u32 {
        (0..width.bytes()).fold(0, |value, k| value | u32::from(self.0[(address.wrapping_add(k) & 0xfff) as usize]) << (8 * k))
    }
    fn write(&mut self, address: u32, width: Width, value: u32) {
        for k in 0..width.bytes() {
            self.0[(address.wrapping_add(k) & 0xfff) as usize] = (value >> (8 * k)) as u8;
        }
    }
}

fn machine(code: &[u16]) -> (Core, Ram) {
    let mut memory = Ram([0; 4096]);
    for (k, half) in code.iter().enumerate() {
        memory.write(2 * k as u32, Width::Half, u32::from(*half));
    }
    (Core::reset(STACK, 1), memory)
}

/// Runs one instruction with the given registers from R0.
fn run(code: &[u16], registers: &[u32]) -> (Core, Ram, Result<u32, Event>) {
    let (mut core, mut memory) = machine(code);
    core.r[..registers.len()].copy_from_slice(registers);
    let outcome = core.step(&mut memory);
    (core, memory, outcome)
}

#[test]
fn add_reports_carry_and_overflow() {
    // adds r0, r1, r2
    let (core, _, cycles) = run(&[0x1888], &[0, 0x8000_0000, 0x8000_0000]);
    assert_eq!((core.r[0], core.zero, core.carry, core.overflow, cycles), (0, true, true, true, Ok(1)));
}

#[test]
fn shift_by_register_of_32_moves_the_last_bit_into_the_carry() {
    // lsls r0, r1
    let (core, _, _) = run(&[0x4088], &[1, 32]);
    assert_eq!((core.r[0], core.carry), (0, true));
}

#[test]
fn it_block_skips_and_keeps_flags() {
    // it eq; movs r0, #5 (moveq); movs r0, #7
    let (mut core, mut memory) = machine(&[0xbf08, 0x2005, 0x2007]);
    for _ in 0..2 {
        core.step(&mut memory).unwrap();
    }
    assert_eq!((core.r[0], core.it_state), (0, 0));
    core.step(&mut memory).unwrap();
    assert_eq!(core.r[0], 7);
}

#[test]
fn branch_costs_the_refill() {
    let (core, _, cycles) = run(&[0xe7fe], &[]);
    assert_eq!((core.r[15], cycles), (0, Ok(3)));
}

#[test]
fn push_and_pop_return_to_the_link_register() {
    // push {r0, lr}; pop {r1, pc}
    let (mut core, mut memory) = machine(&[0xb501, 0xbd02]);
    (core.r[0], core.r[14]) = (0x1234, 0x101);
    assert_eq!(core.step(&mut memory), Ok(3));
    assert_eq!(core.step(&mut memory), Ok(5));
    assert_eq!((core.r[1], core.r[13], core.r[15]), (0x1234, STACK, 0x100));
}

#[test]
fn divide_by_zero_gives_zero() {
    // udiv r0, r1, r2
    assert_eq!(run(&[0xfbb1, 0xf0f2], &[9, 100, 0]).0.r[0], 0);
    assert_eq!(run(&[0xfbb1, 0xf0f2], &[9, 100, 7]).0.r[0], 14);
}

#[test]
fn umaal_adds_both_words() {
    // umaal r0, r1, r2, r3
    let (core, _, _) = run(&[0xfbe2, 0x0163], &[u32::MAX; 4]);
    assert_eq!((core.r[0], core.r[1]), (u32::MAX, u32::MAX));
}

#[test]
fn ssat16_saturates_each_half() {
    // ssat16 r0, #8, r1
    let (core, _, _) = run(&[0xf321, 0x0007], &[0, 0x7fff_8000]);
    assert_eq!((core.r[0], core.saturated), (0x007f_ff80, true));
}

#[test]
fn uadd8_sets_ge_for_sel() {
    // uadd8 r0, r1, r2
    let (core, _, _) = run(&[0xfa81, 0xf042], &[0, 0xff01_ff01, 0x0101_0101]);
    assert_eq!((core.r[0], core.ge), (0x0002_0002, 0b1010));
}

#[test]
fn store_exclusive_fails_without_the_monitor() {
    // ldrex r0, [r1]; strex r2, r0, [r1]; strex r3, r0, [r1]
    let (mut core, mut memory) = machine(&[0xe851, 0x0f00, 0xe841, 0x0200, 0xe841, 0x0300]);
    core.r[1] = 0x400;
    core.r[2] = 7;
    for _ in 0..3 {
        core.step(&mut memory).unwrap();
    }
    assert_eq!((core.r[2], core.r[3]), (0, 1));
}

#[test]
fn basepri_max_only_raises() {
    // msr basepri_max, r0
    let (mut core, mut memory) = machine(&[0xf380, 0x8812]);
    (core.r[0], core.basepri) = (0x80, 0x40);
    core.step(&mut memory).unwrap();
    assert_eq!(core.basepri, 0x40);
}

#[test]
fn fused_multiply_add_rounds_once() {
    // vfma.f32 s0, s1, s2: (1 + 2^-12)² − 1 keeps the term 2^-24.
    let (mut core, mut memory) = machine(&[0xeea0, 0x0a81]);
    let x = 1.0 + 2f32.powi(-12);
    (core.s[0], core.s[1], core.s[2]) = ((-1f32).to_bits(), x.to_bits(), x.to_bits());
    assert_eq!(core.step(&mut memory), Ok(3));
    assert_eq!(f32::from_bits(core.s[0]), 2f32.powi(-11) + 2f32.powi(-24));
}

#[test]
fn infinity_times_zero_plus_quiet_nan_gives_the_default_nan() {
    let (mut core, mut memory) = machine(&[0xeea0, 0x0a81]);
    (core.s[0], core.s[1], core.s[2]) = (0xffc1_2345, 0x7f80_0000, 0);
    core.step(&mut memory).unwrap();
    assert_eq!(core.s[0], 0x7fc0_0000);
}

#[test]
fn advanced_simd_is_undefined() {
    assert_eq!(run(&[0xef0a, 0x2a23], &[]).2, Err(Event::Undefined(0xef0a_2a23)));
}

#[test]
fn conversion_saturates() {
    // vcvt.s32.f32 s0, s1
    let (mut core, mut memory) = machine(&[0xeebd, 0x0ae0]);
    core.s[1] = 1e20f32.to_bits();
    core.step(&mut memory).unwrap();
    assert_eq!(core.s[0], 0x7fff_ffff);
}

#[test]
fn exception_returns_to_the_interrupted_state() {
    for float in [0, 4] {
        let (mut core, mut memory) = machine(&[]);
        memory.write(0x100 + 4 * 16, Width::Word, 0x201);
        core.control = float;
        core.r[13] = STACK - 4;
        core.r[15] = 0x40;
        core.s[3] = 0x1234;
        core.set_xpsr(0xa10f_0000);
        let before = core.clone();
        assert_eq!(core.enter_exception(&mut memory, 16, 0x100), if float == 0 { 12 } else { 29 });
        assert_eq!((core.r[15], core.ipsr, core.r[13] & 7, core.control & 4), (0x200, 16, 0, 0));
        (core.r[0], core.s[3]) = (99, 99);
        let link = core.r[14];
        assert_eq!(link, if float == 0 { 0xffff_fff9 } else { 0xffff_ffe9 });
        if float == 0 {
            core.s[3] = before.s[3];
        }
        core.return_from_exception(&mut memory, link);
        assert_eq!((core.r, core.s, core.xpsr(), core.control), (before.r, before.s, before.xpsr(), before.control));
    }
}

#[test]
fn process_stack_is_banked_across_an_exception() {
    let (mut core, mut memory) = machine(&[]);
    (core.control, core.r[13], core.banked_stack_pointer) = (2, 0x600, STACK);
    core.enter_exception(&mut memory, 11, 0);
    assert_eq!((core.r[13], core.process_stack_pointer(), core.r[14]), (STACK, 0x5e0, 0xffff_fffd));
    core.return_from_exception(&mut memory, 0xffff_fffd);
    assert_eq!((core.r[13], core.main_stack_pointer(), core.control), (0x600, STACK, 2));
}

#[test]
fn events_leave_the_program_counter_as_documented() {
    let cases = [
        (0xbf20, Event::WaitForEvent, 2),
        (0xbf30, Event::WaitForInterrupt, 2),
        (0xbf40, Event::SendEvent, 2),
        (0xdf07, Event::SupervisorCall(7), 2),
        (0xbeab, Event::Breakpoint(0xab), 0),
        (0xde00, Event::Undefined(0xde00), 0),
    ];
    for (encoding, event, pc) in cases {
        let (core, _, outcome) = run(&[encoding], &[]);
        assert_eq!((outcome, core.r[15]), (Err(event), pc));
    }
}

/// No encoding panics: every first halfword with 64 second halfwords, overflow checks on.
#[test]
fn no_encoding_panics() {
    let mut second = 1u32;
    for first in 0..=0xffffu16 {
        for _ in 0..if first >= 0xe800 { 64 } else { 1 } {
            second = second.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let (mut core, mut memory) = machine(&[first, (second >> 16) as u16]);
            core.r.fill(second);
            core.r[15] = 0;
            let outcome = core.step(&mut memory);
            assert!(outcome.is_err() || outcome.is_ok_and(|cycles| (1..=40).contains(&cycles)), "{first:04x}");
        }
    }
}
