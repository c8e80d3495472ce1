//! `palpate verify`: x
use crate::Failure;
use clap::Args;
/// Verify
#[derive(Args)]
pub struct Arguments {
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}
/// Run the verb.
pub fn verify(_arguments: &Arguments) -> Result<(), Failure> {
    Ok(())
}
