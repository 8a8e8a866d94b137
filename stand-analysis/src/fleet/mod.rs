//! Explanations of many logs as one table, and what the table says about the fleet of stands.
//!
//! In: paths of logs, a function that makes the [`Row`] of one log. Out: the rows, kept in a journal as they are computed ([`session`]) and
//! written as one Parquet file ([`table`]); [`run`] computes them on all cores of this machine. [`evaluation`] compares the stands of such
//! tables: changes since a date, effects common to a batch, outliers. Limits: all rows of a table are in memory, about 2 KB each.

pub mod batch;
pub mod change;
pub mod evaluation;
pub mod identity;
pub mod outlier;
pub mod row;
pub mod run;
pub mod session;
pub mod significance;
pub mod table;

pub use identity::IdentityTable;
pub use row::{Alternative, OutputError, ParameterValue, Row};
pub use session::{FileHash, Session, SessionError, Settings};
