//! Parsing: tokens, then a Pratt parser (Pratt 1973) by binding powers.

use super::error::ExpressionError;
use super::node::{Binary, Function, MINUS_BINDING, Node, Variable};
use super::{functions, is_reserved};

/// Largest nesting depth: evaluation is recursive.
const MAX_DEPTH: u16 = 100;
/// Largest number of nodes.
const MAX_NODES: usize = 4096;

/// The nodes of `text`, children first.
pub(super) fn parse(text: &str, parameters: &[String]) -> Result<Vec<Node>, ExpressionError> {
    let tokens = tokens(text)?;
    if tokens.is_empty() {
        return Err(ExpressionError::Empty);
    }
    let mut parser = Parser { tokens, at: 0, parameters, nodes: Vec::new(), depths: Vec::new(), open: 0 };
    parser.expression(0)?;
    match parser.tokens.get(parser.at) {
        Some(token) => Err(token.unexpected("an operator or the end")),
        None => Ok(parser.nodes),
    }
}

#[derive(Debug, Clone, PartialEq)]
enum TokenKind {
    Number(f64),
    Name,
    Symbol,
}

#[derive(Debug, Clone)]
struct Token {
    kind: TokenKind,
    text: String,
    column: usize,
}

impl Token {
    fn unexpected(&self, wants: &'static str) -> ExpressionError {
        ExpressionError::Unexpected { word: self.text.clone(), column: self.column, wants }
    }
}

/// Splits the text into numbers, names and symbols.
fn tokens(text: &str) -> Result<Vec<Token>, ExpressionError> {
    let letters: Vec<char> = text.chars().collect();
    let mut tokens = Vec::new();
    let mut at = 0;
    while let Some(&letter) = letters.get(at) {
        let from = at;
        let run = |mut at: usize, test: &dyn Fn(char) -> bool| {
            while letters.get(at).copied().is_some_and(test) {
                at += 1;
            }
            at
        };
        let is_digit = |c: char| c.is_ascii_digit();
        let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
        let starts_number = letter.is_ascii_digit() || (letter == '.' && letters.get(at + 1).is_some_and(char::is_ascii_digit));
        if letter.is_whitespace() {
            at += 1;
            continue;
        } else if starts_number {
            at = run(at, &is_digit);
            if letters.get(at) == Some(&'.') {
                at = run(at + 1, &is_digit);
            }
            if matches!(letters.get(at), Some('e' | 'E')) {
                let sign = usize::from(matches!(letters.get(at + 1), Some('+' | '-')));
                if letters.get(at + 1 + sign).is_some_and(char::is_ascii_digit) {
                    at = run(at + 1 + sign, &is_digit);
                }
            }
            // `2omega` and `1.2.3` are errors, not numbers.
            at = run(at, &|c| is_part(c) || c == '.');
        } else if letter.is_ascii_alphabetic() || letter == '_' {
            at = run(at, &is_part);
        } else {
            at += 1 + usize::from(matches!(letter, '<' | '>') && letters.get(at + 1) == Some(&'='));
            at = if letter == '*' && letters.get(at) == Some(&'*') { at + 1 } else { at };
        }
        let text: String = letters[from..at].iter().collect();
        let column = from + 1;
        let kind = if starts_number {
            let number = text.parse().ok().filter(|n: &f64| n.is_finite());
            TokenKind::Number(number.ok_or_else(|| ExpressionError::Number { word: text.clone(), column })?)
        } else if letter.is_ascii_alphabetic() || letter == '_' {
            TokenKind::Name
        } else {
            TokenKind::Symbol
        };
        tokens.push(Token { kind, text: if text == "**" { "^".to_owned() } else { text }, column });
    }
    Ok(tokens)
}

struct Parser<'a> {
    tokens: Vec<Token>,
    at: usize,
    parameters: &'a [String],
    nodes: Vec<Node>,
    /// Height of the tree below each node.
    depths: Vec<u16>,
    /// Current nesting depth.
    open: u16,
}

impl Parser<'_> {
    /// Parses operators with a binding power of at least `least`; returns the index of the last node.
    fn expression(&mut self, least: u8) -> Result<u16, ExpressionError> {
        let column = self.tokens.get(self.at).map_or(1, |w| w.column);
        self.open += 1;
        if self.open > MAX_DEPTH {
            return Err(ExpressionError::TooDeep { column });
        }
        let mut left = self.value()?;
        while let Some(token) = self.tokens.get(self.at) {
            let Some(binary) = operator(token) else { break };
            let Some((binds_left, binds_right)) = binary.binding() else { break };
            if binds_left < least {
                break;
            }
            self.at += 1;
            let from = self.nodes.len();
            let right = self.expression(binds_right)?;
            left = match (binary, self.integer_literal(from)) {
                (Binary::Power, Some(power)) => {
                    self.nodes.truncate(from);
                    self.depths.truncate(from);
                    self.push(Node::IntegerPower(left, power))?
                }
                _ => self.push(Node::Binary(binary, left, right))?,
            };
        }
        self.open -= 1;
        Ok(left)
    }

    /// The integer literal that the nodes from `from` on form, with sign; `None` if they are not one up to 16.
    fn integer_literal(&self, from: usize) -> Option<i8> {
        let (number, sign) = match self.nodes[from..] {
            [Node::Constant(c)] => (c, 1),
            [Node::Constant(c), Node::Negative(_)] => (c, -1),
            _ => return None,
        };
        (number.fract() == 0.0 && number <= 16.0).then_some(number as i8 * sign)
    }

    fn value(&mut self) -> Result<u16, ExpressionError> {
        const WANTS: &str = "a number, a name or a bracket";
        let token = self.tokens.get(self.at).cloned().ok_or(ExpressionError::Ends { wants: WANTS })?;
        self.at += 1;
        match (&token.kind, token.text.as_str()) {
            (TokenKind::Number(number), _) => self.push(Node::Constant(*number)),
            (TokenKind::Name, _) => self.name(&token),
            (TokenKind::Symbol, "(") => {
                let inside = self.expression(0)?;
                self.expect(")")?;
                Ok(inside)
            }
            (TokenKind::Symbol, "-") => {
                let value = self.expression(MINUS_BINDING)?;
                self.push(Node::Negative(value))
            }
            (TokenKind::Symbol, "+") => self.expression(MINUS_BINDING),
            _ => Err(token.unexpected(WANTS)),
        }
    }

    fn name(&mut self, token: &Token) -> Result<u16, ExpressionError> {
        let name = token.text.as_str();
        let column = token.column;
        if self.tokens.get(self.at).is_some_and(|w| w.text == "(") {
            return self.call(name, column);
        }
        if name == "pi" {
            return self.push(Node::Pi);
        }
        if let Some(variable) = Variable::of(name) {
            return self.push(Node::Variable(variable));
        }
        if let Some(k) = self.parameters.iter().position(|p| p == name).and_then(|k| u16::try_from(k).ok()) {
            return self.push(Node::Parameter(k));
        }
        if is_reserved(name) {
            return Err(ExpressionError::NoArguments { name: name.to_owned(), column });
        }
        let known = Variable::ALL.iter().map(|v| v.name()).chain(["pi"]).chain(self.parameters.iter().map(String::as_str));
        Err(ExpressionError::UnknownName { name: name.to_owned(), column, near: crate::words::nearest(name, known) })
    }

    fn call(&mut self, name: &str, column: usize) -> Result<u16, ExpressionError> {
        let Some((_, wants)) = functions().find(|(f, _)| *f == name) else {
            let near = crate::words::nearest(name, functions().map(|f| f.0));
            return Err(ExpressionError::UnknownFunction { name: name.to_owned(), column, near });
        };
        self.at += 1;
        let mut arguments = Vec::new();
        if self.tokens.get(self.at).is_none_or(|w| w.text != ")") {
            arguments.push(self.expression(0)?);
            while self.tokens.get(self.at).is_some_and(|w| w.text == ",") {
                self.at += 1;
                arguments.push(self.expression(0)?);
            }
        }
        self.expect(")")?;
        let binary = Binary::FUNCTIONS.into_iter().find(|f| f.name() == name);
        match (arguments.as_slice(), Function::of(name), binary) {
            (&[a], Some(function), _) => self.push(Node::Call(function, a)),
            (&[a, b], _, Some(binary)) => self.push(Node::Binary(binary, a, b)),
            (&[a, b, c], None, None) => self.push(Node::If(a, b, c)),
            _ => Err(ExpressionError::Arguments { name: name.to_owned(), column, wants, has: arguments.len() }),
        }
    }

    fn expect(&mut self, mark: &'static str) -> Result<(), ExpressionError> {
        const WANTS: &str = "an operator, a comma or a closing bracket";
        match self.tokens.get(self.at) {
            Some(token) if token.text == mark => {
                self.at += 1;
                Ok(())
            }
            Some(token) => Err(token.unexpected(WANTS)),
            None => Err(ExpressionError::Ends { wants: "a closing bracket" }),
        }
    }

    fn push(&mut self, node: Node) -> Result<u16, ExpressionError> {
        let below = |k: &u16| self.depths[usize::from(*k)];
        let depth = match &node {
            Node::Constant(_) | Node::Pi | Node::Variable(_) | Node::Parameter(_) => 0,
            Node::Negative(a) | Node::Call(_, a) | Node::IntegerPower(a, _) => below(a) + 1,
            Node::Binary(_, a, b) => below(a).max(below(b)) + 1,
            Node::If(a, b, c) => below(a).max(below(b)).max(below(c)) + 1,
        };
        let column = self.tokens.get(self.at.saturating_sub(1)).map_or(1, |w| w.column);
        if depth > MAX_DEPTH || self.nodes.len() >= MAX_NODES {
            return Err(ExpressionError::TooDeep { column });
        }
        self.nodes.push(node);
        self.depths.push(depth);
        Ok((self.nodes.len() - 1) as u16)
    }
}

fn operator(token: &Token) -> Option<Binary> {
    const ALL: [Binary; 9] = [
        Binary::Add,
        Binary::Subtract,
        Binary::Multiply,
        Binary::Divide,
        Binary::Power,
        Binary::Less,
        Binary::LessOrEqual,
        Binary::Greater,
        Binary::GreaterOrEqual,
    ];
    ALL.into_iter().find(|p| token.kind == TokenKind::Symbol && p.name() == token.text)
}
