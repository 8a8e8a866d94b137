//! The laboratory course.
#![allow(clippy::unwrap_used)]

mod lab_course;
#[path = "../lab_students/mod.rs"]
mod lab_students;
