//! The laboratory course.
#![allow(clippy::unwrap_used)]

#[path = "../common/mod.rs"]
mod common;
mod lab_course;
#[path = "../lab_students/mod.rs"]
mod lab_students;
