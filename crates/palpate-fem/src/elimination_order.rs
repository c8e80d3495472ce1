//! Elimination order of a body's nodes: nested dissection by METIS, or approximate minimum degree in WebAssembly, where there is no C library.

use crate::assembly::Assembly;
use crate::solve_error::SolveError;
#[cfg(any(target_family = "wasm", test))]
use faer::{
    dyn_stack::{MemBuffer, MemStack},
    sparse::SymbolicSparseColMat,
    sparse::linalg::amd,
};
#[cfg(not(target_family = "wasm"))]
use std::sync::{Mutex, PoisonError};

/// Number of nodes from which an order of their own reduces fill-in.
const ORDERED_FROM: usize = 64;

/// Node numbers in elimination order.
///
/// # Errors
/// [`SolveError::SymbolicFactor`].
pub(crate) fn elimination_order(assembly: &Assembly) -> Result<Vec<usize>, SolveError> {
    if assembly.nodes() < ORDERED_FROM {
        return Ok((0..assembly.nodes()).collect());
    }
    #[cfg(not(target_family = "wasm"))]
    return nested_dissection(assembly);
    #[cfg(target_family = "wasm")]
    return minimum_degree(assembly);
}

/// Approximate minimum degree of the node graph (Amestoy, Davis and Duff 1996); node numbers in elimination order.
///
/// Fills in no more than nested dissection on bodies of some thousand nodes, and more on large ones.
#[cfg(any(target_family = "wasm", test))]
fn minimum_degree(assembly: &Assembly) -> Result<Vec<usize>, SolveError> {
    let n = assembly.nodes();
    let rows = assembly.columns.iter().map(|&node| node as usize).collect();
    let graph = SymbolicSparseColMat::new_checked(n, n, assembly.offsets.clone(), None, rows);
    let (mut order, mut inverse) = (vec![0_usize; n], vec![0_usize; n]);
    let mut memory = MemBuffer::new(amd::order_scratch::<usize>(n, assembly.columns.len()));
    amd::order(&mut order, &mut inverse, graph.as_ref(), amd::Control::default(), MemStack::new(&mut memory))
        .map_err(|error| SolveError::SymbolicFactor(format!("{error:?}")))?;
    Ok(order)
}

/// METIS draws the C library's random numbers, which a process has one series of: it begins the series, and two at once would take each
/// other's numbers. The elimination order, and so the last bits of a recording, depend on them.
#[cfg(not(target_family = "wasm"))]
static METIS: Mutex<()> = Mutex::new(());

/// Nested dissection of the node graph by METIS; node numbers in elimination order.
#[cfg(not(target_family = "wasm"))]
fn nested_dissection(assembly: &Assembly) -> Result<Vec<usize>, SolveError> {
    let n = assembly.nodes();
    let too_large = |_| SolveError::SymbolicFactor("more than 2³¹ entries".into());
    let mut starts = vec![0_i32];
    let mut neighbours = Vec::new();
    for node in 0..n {
        let row = &assembly.columns[assembly.offsets[node]..assembly.offsets[node + 1]];
        neighbours.extend(row.iter().filter(|&&other| other as usize != node).map(|&other| other as i32));
        starts.push(i32::try_from(neighbours.len()).map_err(too_large)?);
    }
    let mut count = i32::try_from(n).map_err(too_large)?;
    let (mut order, mut inverse) = (vec![0_i32; n], vec![0_i32; n]);
    let _alone = METIS.lock().unwrap_or_else(PoisonError::into_inner);
    // SAFETY: the arrays have the lengths that METIS 5 states for METIS_NodeND (starts n + 1, order and
    // inverse n, neighbours as starts say, without self loops); null asks for no weights and defaults.
    let status = unsafe {
        metis_sys::METIS_NodeND(
            &mut count,
            starts.as_mut_ptr(),
            neighbours.as_mut_ptr(),
            std::ptr::null_mut(),
            std::ptr::null_mut(),
            order.as_mut_ptr(),
            inverse.as_mut_ptr(),
        )
    };
    if status != metis_sys::rstatus_et_METIS_OK {
        return Err(SolveError::SymbolicFactor(format!("METIS returned {status}")));
    }
    Ok(order.into_iter().map(|node| node as usize).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discretisation::Discretisation;
    use crate::element::ElementOrder;
    use palpate::Material;
    use palpate_mesh::box_mesh;

    fn assembly(cells: [u32; 3]) -> Assembly {
        let mesh = box_mesh([0.3, 0.2, 0.1], cells).expect("a good box");
        let discretisation = Discretisation::new(&mesh, ElementOrder::Quadratic);
        Assembly::new(&discretisation, &[Material::isotropic(1e4, 0.3, 1000.0)])
    }

    #[test]
    fn elimination_orders_are_the_same_where_several_are_computed_at_once() {
        const AT_ONCE: usize = 4;
        const TIMES: usize = 3;
        let assembly = assembly([8, 7, 6]);
        let order = || nested_dissection(&assembly).expect("an order");
        let alone = order();
        std::thread::scope(|scope| {
            for _ in 0..AT_ONCE {
                scope.spawn(|| (0..TIMES).for_each(|_| assert!(order() == alone)));
            }
        });
    }

    /// Entries of the factor of the node graph, by elimination.
    fn fill(assembly: &Assembly, order: &[usize]) -> usize {
        let mut place = vec![0; order.len()];
        order.iter().enumerate().for_each(|(at, &node)| place[node] = at);
        let row = |node: usize| &assembly.columns[assembly.offsets[node]..assembly.offsets[node + 1]];
        let mut columns: Vec<std::collections::BTreeSet<usize>> = vec![Default::default(); order.len()];
        for (at, &node) in order.iter().enumerate() {
            columns[at].extend(row(node).iter().map(|&other| place[other as usize]).filter(|&to| to > at));
        }
        for at in 0..order.len() {
            let below = columns[at].clone();
            if let Some(&parent) = below.first() {
                columns[parent].extend(below.iter().copied().filter(|&to| to > parent));
            }
        }
        columns.iter().map(|column| 1 + column.len()).sum()
    }

    #[test]
    fn orders_are_permutations_that_fill_in_far_less_than_the_nodes_numbers_do() {
        let assembly = assembly([10, 8, 6]);
        let natural: Vec<usize> = (0..assembly.nodes()).collect();
        let entries = fill(&assembly, &natural);
        for order in [nested_dissection(&assembly), minimum_degree(&assembly)] {
            let order = order.expect("an order");
            let filled = fill(&assembly, &order);
            let mut sorted = order;
            sorted.sort_unstable();
            assert_eq!(sorted, natural);
            // 21 and 22 times less.
            assert!(10 * filled < entries, "{filled} of {entries}");
        }
    }
}
