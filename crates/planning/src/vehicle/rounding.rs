//! Whole numbers of arcs from a mixture.
//!
//! From the mixture rounded down, arcs are added by how much they lower the excess of the variances per cost until the
//! tolerances hold; then arcs are taken away, or exchanged for cheaper ones, while they hold. The result is not proven
//! best among whole numbers; the bound of the mixture says how far it can be from that.

use super::design::{Choice, Mixture};
use groma_models::{Cancelled, Token};

/// Repetitions that represent none, so that variances stay finite.
const LITTLE: f64 = 1e-8;
/// Passes of exchange at most.
const PASSES: usize = 20;

/// Whole repetitions that hold the tolerances.
///
/// # Errors
/// When the token cancels the work.
pub fn rounded(choice: &Choice, mixture: &Mixture, token: &Token) -> Result<Vec<usize>, Cancelled> {
    let support = mixture.support.clone();
    let mut counts: Vec<usize> = mixture.repetitions.iter().map(|w| w.floor() as usize).collect();
    fill(choice, &support, &mut counts, token)?;
    if worst(choice, &counts) > 1.0 {
        return Ok(mixture.repetitions.iter().map(|w| w.ceil() as usize).collect());
    }
    prune(choice, &support, &mut counts, token)?;
    for _ in 0..PASSES {
        if !exchange(choice, &support, &mut counts, token)? {
            break;
        }
    }
    Ok(counts)
}

fn worst(choice: &Choice, counts: &[usize]) -> f64 {
    let repetitions: Vec<f64> = counts.iter().map(|&n| n as f64).collect();
    choice.worst(&repetitions)
}

/// Sum of what the variances are above 1; of a mixture that does not determine all parameters, as if each arc were driven a little.
fn excess(choice: &Choice, support: &[usize], counts: &[usize]) -> f64 {
    let mut repetitions: Vec<f64> = counts.iter().map(|&n| n as f64).collect();
    support.iter().for_each(|&k| repetitions[k] += LITTLE);
    let over = |c: nalgebra::DMatrix<f64>| c.diagonal().iter().map(|v| (v - 1.0).max(0.0)).sum();
    choice.covariance(&repetitions).map_or(f64::INFINITY, over)
}

fn fill(choice: &Choice, support: &[usize], counts: &mut [usize], token: &Token) -> Result<(), Cancelled> {
    while worst(choice, counts) > 1.0 {
        token.check()?;
        let now = excess(choice, support, counts);
        let gain = |&k: &usize| {
            let mut more = counts.to_vec();
            more[k] += 1;
            (now - excess(choice, support, &more)) / choice.cost[k]
        };
        let gains = support.iter().map(|k| (gain(k), *k));
        let best = gains.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(gain, _)| *gain > 0.0);
        let Some((_, best)) = best else { return Ok(()) };
        counts[best] += 1;
    }
    Ok(())
}

fn prune(choice: &Choice, support: &[usize], counts: &mut [usize], token: &Token) -> Result<(), Cancelled> {
    let mut order = support.to_vec();
    order.sort_by(|a, b| choice.cost[*b].total_cmp(&choice.cost[*a]));
    for k in order {
        while counts[k] > 0 {
            token.check()?;
            counts[k] -= 1;
            if worst(choice, counts) > 1.0 {
                counts[k] += 1;
                break;
            }
        }
    }
    Ok(())
}

/// Takes one or two arcs away and puts a cheaper one in, the first time that this holds; returns whether it did.
fn exchange(choice: &Choice, support: &[usize], counts: &mut [usize], token: &Token) -> Result<bool, Cancelled> {
    let driven: Vec<usize> = support.iter().copied().filter(|&k| counts[k] > 0).collect();
    for &a in &driven {
        for &b in driven.iter().chain([&usize::MAX]) {
            if (a == b && counts[a] < 2) || b < a {
                continue;
            }
            token.check()?;
            let less = choice.cost[a] + choice.cost.get(b).copied().unwrap_or(0.0);
            for &k in support.iter().filter(|&&k| choice.cost[k] < less * (1.0 - 1e-9)) {
                let mut other = counts.to_vec();
                other[a] -= 1;
                if b != usize::MAX {
                    other[b] -= 1;
                }
                other[k] += 1;
                if worst(choice, &other) <= 1.0 {
                    counts.copy_from_slice(&other);
                    return Ok(true);
                }
            }
        }
    }
    Ok(false)
}
