//! The laboratory course.

mod lab_course;
#[path = "../lab_students/mod.rs"]
mod lab_students;
