//! The verdict on a search: cause, or unknown structure.
//!
//! In: a search. Out: an [`outcome::Outcome`]. [`judgement`] decides, with the structures that no effect has ([`unknown_structure`], of
//! [`piecewise_linear`] and [`symbolic`] laws).

pub mod judgement;
pub mod outcome;
mod piecewise_linear;
mod symbolic;
mod unknown_structure;
