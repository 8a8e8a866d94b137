//! What may go wrong with the drive, and what is done about it: it is switched off, and says why.
//!
//! What must be fast is judged in the control interrupt ([`crate::speed_loop`]).

mod fault;

pub use fault::Fault;
