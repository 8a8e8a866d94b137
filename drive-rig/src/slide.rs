//! Coulomb friction without smoothing: the rotor slides, passes through zero, or sticks.

use std::ops::{Add, Mul};

use drive_model::Scalar;

/// A rotor of inertia J over `h` seconds under a constant torque and a Coulomb torque: (rate at the end, change of angle).
///
/// The soft threshold of Moreau's scheme, ω' = sign(free)·max(|free| − h·coulomb/J, 0), solved in closed form also where the rate passes
/// through zero within the step: until then the Coulomb torque opposes the old direction; afterwards the rotor sticks (|torque| ≤ coulomb)
/// or slides in the other direction. There the error of Moreau's step is up to 2·h·coulomb/J. Derivatives are exact almost everywhere.
///
/// The step length is a plain number, or a scalar with derivatives where an event within the step sets it.
#[inline]
pub fn slide<S, H>(omega: S, torque: S, coulomb: S, inertia: S, h: H) -> (S, S)
where
    S: Scalar + Mul<H, Output = S> + Add<H, Output = S>,
    H: Copy,
{
    if omega == 0.0 {
        return from_rest(torque, coulomb, inertia, h);
    }
    let forward = omega > 0.0;
    let acceleration = if forward { torque - coulomb } else { torque + coulomb } / inertia;
    let change = acceleration * h;
    let end = omega + change;
    if (end.re() >= 0.0) == forward && end != 0.0 {
        return (end, (omega + change * 0.5) * h);
    }
    if acceleration == 0.0 {
        return (omega, omega * h);
    }
    let stop_s = -omega / acceleration;
    let coasted = omega * stop_s * 0.5;
    if torque.re().abs() <= coulomb.re() {
        return (S::zero(), coasted);
    }
    let acceleration = if forward { torque + coulomb } else { torque - coulomb } / inertia;
    let rest_s = -stop_s + h;
    let end = acceleration * rest_s;
    (end, coasted + end * rest_s * 0.5)
}

fn from_rest<S, H>(torque: S, coulomb: S, inertia: S, h: H) -> (S, S)
where
    S: Scalar + Mul<H, Output = S>,
    H: Copy,
{
    let free = if torque > coulomb {
        torque - coulomb
    } else if -torque > coulomb {
        torque + coulomb
    } else {
        return (S::zero(), S::zero());
    };
    let end = free / inertia * h;
    (end, end * h * 0.5)
}
