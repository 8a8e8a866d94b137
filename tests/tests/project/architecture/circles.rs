//! Strongly connected components of the import graph.

use std::collections::BTreeSet;

/// The import circles among `count` files: strongly connected components of more than one file (Kosaraju's algorithm).
pub fn circles(count: usize, imports: &[(usize, usize)]) -> Vec<BTreeSet<usize>> {
    let successors = |node: usize, forward: bool| {
        imports.iter().filter_map(move |&(from, to)| match (forward, from == node, to == node) {
            (true, true, _) => Some(to),
            (false, _, true) => Some(from),
            _ => None,
        })
    };
    let visit = |start: usize, forward: bool, seen: &mut Vec<bool>, finished: &mut Vec<usize>| {
        let mut stack = vec![(start, false)];
        while let Some((node, is_done)) = stack.pop() {
            if is_done {
                finished.push(node);
            } else if !std::mem::replace(&mut seen[node], true) {
                stack.push((node, true));
                stack.extend(successors(node, forward).map(|next| (next, false)));
            }
        }
    };
    let (mut seen, mut order) = (vec![false; count], Vec::new());
    (0..count).for_each(|node| visit(node, true, &mut seen, &mut order));
    let mut seen = vec![false; count];
    let mut found = Vec::new();
    for &node in order.iter().rev() {
        let mut component = Vec::new();
        visit(node, false, &mut seen, &mut component);
        if component.len() > 1 {
            found.push(component.into_iter().collect());
        }
    }
    found
}
