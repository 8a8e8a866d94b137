//! Functions of the manual's pseudocode on integers (A2.2, A7.4).

/// Bit `n`.
#[inline]
pub fn bit(x: u32, n: u32) -> bool {
    x >> n & 1 != 0
}

/// Sign extension of the low `n` bits.
#[inline]
pub fn sign_extend(x: u32, n: u32) -> u32 {
    ((x << (32 - n)) as i32 >> (32 - n)) as u32
}

/// AddWithCarry (A2.2.1): sum, carry, overflow.
#[inline]
pub fn add_with_carry(a: u32, b: u32, carry: bool) -> (u32, bool, bool) {
    let (partial, first) = a.overflowing_add(b);
    let (sum, second) = partial.overflowing_add(u32::from(carry));
    (sum, first || second, ((a ^ sum) & (b ^ sum)) >> 31 != 0)
}

/// Kinds of shifts as encoded in two bits: LSL, LSR, ASR, ROR.
pub const LSL: u32 = 0;
const LSR: u32 = 1;
pub const ASR: u32 = 2;

/// Shift_C by a register's amount (A7.4.2): value and carry.
#[inline]
pub fn shift(value: u32, kind: u32, amount: u32, carry: bool) -> (u32, bool) {
    if amount == 0 {
        return (value, carry);
    }
    match kind {
        LSL if amount < 32 => (value << amount, bit(value, 32 - amount)),
        LSL => (0, amount == 32 && value & 1 != 0),
        LSR if amount < 32 => (value >> amount, bit(value, amount - 1)),
        LSR => (0, amount == 32 && value >> 31 != 0),
        ASR if amount < 32 => ((value as i32 >> amount) as u32, bit(value, amount - 1)),
        ASR => ((value as i32 >> 31) as u32, value >> 31 != 0),
        _ => {
            let rotated = value.rotate_right(amount & 31);
            (rotated, rotated >> 31 != 0)
        }
    }
}

/// Shift by an immediate (DecodeImmShift, A7.4.2): 0 is 32 for LSR and ASR, and RRX for ROR.
#[inline]
pub fn shift_immediate(value: u32, kind: u32, amount: u32, carry: bool) -> (u32, bool) {
    match (kind, amount) {
        (LSL, 0) => (value, carry),
        (LSR | ASR, 0) => shift(value, kind, 32, carry),
        (_, 0) => (value >> 1 | u32::from(carry) << 31, value & 1 != 0),
        _ => shift(value, kind, amount, carry),
    }
}

/// ThumbExpandImm_C (A5.3.2).
#[inline]
pub fn expand_immediate(immediate: u32, carry: bool) -> (u32, bool) {
    if immediate >> 10 == 0 {
        let byte = immediate & 0xFF;
        let value = match immediate >> 8 & 3 {
            0 => byte,
            1 => byte << 16 | byte,
            2 => byte << 24 | byte << 8,
            _ => byte * 0x0101_0101,
        };
        (value, carry)
    } else {
        let value = (0x80 | immediate & 0x7F).rotate_right(immediate >> 7);
        (value, value >> 31 != 0)
    }
}
