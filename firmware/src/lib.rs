//! The stand’s program, portable part.
#![no_std]
