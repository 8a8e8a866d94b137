//! Nodes of the expression tree.

/// One node; children are indices of earlier nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Node {
    Constant(f64),
    Pi,
    Variable(Variable),
    Parameter(u16),
    Negative(u16),
    Call(Function, u16),
    Binary(Binary, u16, u16),
    /// A power with an integer literal as exponent.
    IntegerPower(u16, i8),
    /// Condition (true if not zero), value if true, value if false.
    If(u16, u16, u16),
}

/// A variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Variable {
    Time,
    Theta,
    Omega,
    Current,
    Voltage,
    Temperature,
}

impl Variable {
    pub const ALL: [Variable; 6] = [Self::Time, Self::Theta, Self::Omega, Self::Current, Self::Voltage, Self::Temperature];

    pub fn name(self) -> &'static str {
        match self {
            Variable::Time => "t",
            Variable::Theta => "theta",
            Variable::Omega => "omega",
            Variable::Current => "i",
            Variable::Voltage => "u",
            Variable::Temperature => "T",
        }
    }

    pub fn of(name: &str) -> Option<Variable> {
        Self::ALL.into_iter().find(|v| v.name() == name)
    }
}

macro_rules! functions {
    ($($variant:ident $name:literal)*) => {
        /// A function of one argument.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub(super) enum Function { $($variant),* }

        impl Function {
            pub const ALL: &[Function] = &[$(Function::$variant),*];

            pub fn name(self) -> &'static str {
                match self { $(Function::$variant => $name),* }
            }
        }
    };
}

functions! {
    Sin "sin" Cos "cos" Tan "tan" Asin "asin" Acos "acos" Atan "atan"
    Sinh "sinh" Cosh "cosh" Tanh "tanh"
    Exp "exp" Ln "ln" Log10 "log10" Log "log" Sqrt "sqrt"
    Abs "abs" Sign "sign" Floor "floor"
}

impl Function {
    pub fn of(name: &str) -> Option<Function> {
        Self::ALL.iter().copied().find(|f| f.name() == name)
    }
}

/// An operator or a function with two arguments.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    Atan2,
    Min,
    Max,
    /// `pow(a, b)`: the function of [`Binary::Power`], apart from it because it is printed as it was written.
    Pow,
}

impl Binary {
    /// Those written as functions.
    pub const FUNCTIONS: [Binary; 4] = [Binary::Atan2, Binary::Min, Binary::Max, Binary::Pow];

    pub fn name(self) -> &'static str {
        match self {
            Binary::Add => "+",
            Binary::Subtract => "-",
            Binary::Multiply => "*",
            Binary::Divide => "/",
            Binary::Power => "^",
            Binary::Less => "<",
            Binary::LessOrEqual => "<=",
            Binary::Greater => ">",
            Binary::GreaterOrEqual => ">=",
            Binary::Atan2 => "atan2",
            Binary::Min => "min",
            Binary::Max => "max",
            Binary::Pow => "pow",
        }
    }

    /// Left and right binding power; `None` for functions. `^` is right-associative and binds more strongly than the unary minus.
    pub fn binding(self) -> Option<(u8, u8)> {
        Some(match self {
            Binary::Less | Binary::LessOrEqual | Binary::Greater | Binary::GreaterOrEqual => (1, 2),
            Binary::Add | Binary::Subtract => (3, 4),
            Binary::Multiply | Binary::Divide => (5, 6),
            Binary::Power => (10, 9),
            _ => return None,
        })
    }
}

/// Binding power of the unary minus: `-a * b` is `(-a) * b`, `-a ^ b` is `-(a ^ b)`.
pub(super) const MINUS_BINDING: u8 = 7;
