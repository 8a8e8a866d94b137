//! Printing: nodes to text, with only the necessary brackets.

use super::node::{Binary, MINUS_BINDING, Node};

/// The text of the root node.
pub(super) fn text(nodes: &[Node], parameters: &[String]) -> String {
    let mut out = String::new();
    write(nodes, parameters, nodes.len().wrapping_sub(1), 0, &mut out);
    out
}

/// Writes one node, in brackets if its binding power is below `least`.
fn write(nodes: &[Node], parameters: &[String], at: usize, least: u8, out: &mut String) {
    let Some(node) = nodes.get(at) else { return };
    let child = |k: u16, least: u8, out: &mut String| write(nodes, parameters, usize::from(k), least, out);
    let call = |name: &str, arguments: &[u16], out: &mut String| {
        out.push_str(name);
        out.push('(');
        for (k, &argument) in arguments.iter().enumerate() {
            if k > 0 {
                out.push_str(", ");
            }
            child(argument, 0, out);
        }
        out.push(')');
    };
    let own = match node {
        Node::Negative(_) => MINUS_BINDING,
        Node::IntegerPower(..) => 9,
        Node::Binary(binary, ..) => binary.binding().map_or(u8::MAX, |b| b.0.min(b.1)),
        _ => u8::MAX,
    };
    // Equal binding power on the weaker side needs brackets too: a - (b - c), (a ^ b) ^ c.
    let brackets = own < least;
    if brackets {
        out.push('(');
    }
    match node {
        Node::Constant(c) => {
            let mut buffer = zmij::Buffer::new();
            let number = buffer.format_finite(*c);
            out.push_str(number.strip_suffix(".0").unwrap_or(number));
        }
        Node::Pi => out.push_str("pi"),
        Node::Variable(variable) => out.push_str(variable.name()),
        Node::Parameter(k) => out.push_str(parameters.get(usize::from(*k)).map_or("?", String::as_str)),
        Node::Negative(a) => {
            out.push('-');
            child(*a, MINUS_BINDING, out);
        }
        Node::Call(function, a) => call(function.name(), &[*a], out),
        Node::If(a, b, c) => call("if", &[*a, *b, *c], out),
        Node::IntegerPower(a, power) => {
            child(*a, 10, out);
            out.push_str(" ^ ");
            out.push_str(&power.to_string());
        }
        Node::Binary(binary, a, b) => match binary.binding() {
            None => call(binary.name(), &[*a, *b], out),
            Some((left, right)) => {
                child(*a, left, out);
                out.push(' ');
                out.push_str(binary.name());
                out.push(' ');
                child(*b, if *binary == Binary::Power { 9 } else { right }, out);
            }
        },
    }
    if brackets {
        out.push(')');
    }
}
