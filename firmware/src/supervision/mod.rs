//! What may go wrong with the drive, and what is done about it: it is switched off, and says why.
//!
//! What must be fast is judged in the control interrupt ([`crate::speed_loop`]); what may take milliseconds is [`Watch`]'s, which a task
//! feeds with each row and whose causes go to the interrupt as the `trip` of an order. [`Settings`] hold the thresholds of both.

mod settings;
mod watch;

pub use settings::Settings;
pub use watch::Watch;
