//! Calibration records: computed from a session's folder, stored, recomputed and compared, followed over time, certified.

pub mod apply;
pub mod archive;
pub mod certificate;
pub mod record;
pub mod store;
pub mod stored_record;
pub mod trend;
