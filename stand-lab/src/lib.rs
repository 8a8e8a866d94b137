//! Laboratory course: assignments on a device whose true values are sealed, the student's answers, and their judgement. An assignment is
//! called a work; a student may have several attempts at it, each with other true values.
//!
//! Input: the definitions in `labs/` ([`course`]), the teacher's key ([`seal`]), a work folder ([`work`]). Output: data, worded by
//! `stand_report::lab`: [`start`] fills a work folder with logs, instructions and a table of answers; [`form`] reads and writes the table as the
//! fields of a form; [`check`] examines the answers without the true values and records their hash in a chained journal ([`journal`]);
//! [`grade`] replays the measurement with the key, compares the logs, and judges the answers ([`judge`]). [`archive`] packs a work folder.
//!
//! On a real stand the logs are recorded over a connection ([`stand_recording`]), the folder has their sealed hashes ([`real_stand`]) in
//! place of a replay, and the values are compared with the teacher's reference ([`teacher_reference`]).
//!
//! Limits: the true values of a simulated device follow from key, work, student and attempt, so that whoever has the key has them. The
//! journal shows edits of entries; a student who writes the whole journal anew is found only by the code that [`check`] printed, if the teacher noted it.
//! docs/laboratory-course.md describes both.

pub mod answers;
pub mod archive;
pub mod check;
pub mod course;
mod draw;
mod drift_task;
mod error;
pub mod form;
mod friction_task;
pub mod grade;
mod hunt;
pub mod journal;
pub mod judge;
pub mod measurement;
mod observers_task;
mod once_per_turn_task;
pub mod real_stand;
pub mod seal;
pub mod stand_recording;
pub mod start;
pub mod teacher_reference;
pub mod work;

pub use error::LabError;
