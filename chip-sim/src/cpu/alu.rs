//! Arithmetic of the manual's pseudocode: AddWithCarry, shifts, immediates, saturation (A2.2.1, A7.4, A5.3.2).

/// Bit `n` of `value`.
#[inline(always)]
pub(super) fn bit(value: u32, n: u32) -> bool {
    value >> n & 1 != 0
}

/// The low `width` bits (1 to 32) of `value`, sign-extended.
#[inline(always)]
pub(super) fn sign_extend(value: u32, width: u32) -> u32 {
    ((value << (32 - width)) as i32 >> (32 - width)) as u32
}

/// AddWithCarry (A2.2.1): sum, carry out, overflow.
#[inline(always)]
pub(super) fn add_with_carry(a: u32, b: u32, carry: bool) -> (u32, bool, bool) {
    let (partial, carry_1) = a.overflowing_add(b);
    let (sum, carry_2) = partial.overflowing_add(u32::from(carry));
    (sum, carry_1 | carry_2, ((a ^ sum) & (b ^ sum)) >> 31 != 0)
}

/// Shift_C with an amount of 0 to 255 (A2.2.1); kind 0 LSL, 1 LSR, 2 ASR, 3 ROR. Returns the value and the carry.
#[inline]
pub(super) fn shift(value: u32, kind: u32, amount: u32, carry: bool) -> (u32, bool) {
    if amount == 0 {
        return (value, carry);
    }
    match kind {
        0 if amount < 32 => (value << amount, bit(value, 32 - amount)),
        0 => (0, amount == 32 && value & 1 != 0),
        1 if amount < 32 => (value >> amount, bit(value, amount - 1)),
        1 => (0, amount == 32 && value >> 31 != 0),
        2 if amount < 32 => ((value as i32 >> amount) as u32, bit(value, amount - 1)),
        2 => ((value as i32 >> 31) as u32, value >> 31 != 0),
        _ => {
            let rotated = value.rotate_right(amount & 31);
            (rotated, rotated >> 31 != 0)
        }
    }
}

/// DecodeImmShift and Shift_C (A7.4.2): an amount of 0 means 32 for LSR and ASR, and RRX for ROR.
#[inline]
pub(super) fn shift_immediate(value: u32, kind: u32, amount: u32, carry: bool) -> (u32, bool) {
    match (kind, amount) {
        (0, 0) => (value, carry),
        (1 | 2, 0) => shift(value, kind, 32, carry),
        (3, 0) => (value >> 1 | u32::from(carry) << 31, value & 1 != 0),
        _ => shift(value, kind, amount, carry),
    }
}

/// ThumbExpandImm_C (A5.3.2): the constant of twelve bits and the carry.
#[inline]
pub(super) fn expand_immediate(imm12: u32, carry: bool) -> (u32, bool) {
    if imm12 >> 10 != 0 {
        let value = (0x80 | imm12 & 0x7f).rotate_right(imm12 >> 7);
        return (value, value >> 31 != 0);
    }
    let byte = imm12 & 0xff;
    let value = match imm12 >> 8 & 3 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        _ => byte * 0x0101_0101,
    };
    (value, carry)
}

/// Shift amount imm3:imm2 of a second halfword.
#[inline(always)]
pub(super) fn shift_amount(second: u32) -> u32 {
    second >> 10 & 0x1c | second >> 6 & 3
}

/// Signed halfword of `value`: the upper one if `top`.
#[inline(always)]
pub(super) fn signed_half(value: u32, top: bool) -> i64 {
    i64::from((if top { value >> 16 } else { value }) as i16)
}
