//! Known answers, one test per group of encodings.
