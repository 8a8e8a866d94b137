//! Errors that name the parameters which would mend them.

/// An error that the caller can mend by other values of parameters. A program with options says which options these are.
pub trait NamesParameters {
    /// The parameters, as the functions and settings of the library name them (`latitude_deg`); empty where none would help.
    fn parameters(&self) -> Vec<&str>;
}
