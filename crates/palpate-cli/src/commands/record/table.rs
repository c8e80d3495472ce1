//! `palpate record --dense`: the paper's table R[s] of a body, written shard by shard.

use crate::failure::Failure;
use crate::progress::Bars;
use clap::{Args, ValueEnum};
use glam::DVec3;
use palpate::{Metadata, Sampling};
use palpate_fem::table::{COLUMN_BLOCK, TableMethod, TableParameters, TableRecorder};
use palpate_fem::{Progress, RecordExtent, RecordedBody};
use palpate_mesh::Mesh;
use palpate_scene::{NodeSelection, select_nodes, union_of_nodes};
use palpate_store::{Compression, Location, Number, Part, TableAttributes, TableContent, TableStore};
use rayon::prelude::*;

/// Options of a recorded table.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "The paper's table (direct convolution)")]
pub struct TableArguments {
    /// Also write the table R[s], a Zarr store: a folder, or s3://BUCKET/PREFIX. Run the same command again to go on after a stop
    #[arg(long, value_name = "OUT.zarr")]
    pub dense: Option<String>,
    /// Length of the responses [s]
    #[arg(long, value_name = "S", default_value_t = 1.0, allow_negative_numbers = true, requires = "dense")]
    pub duration: f64,
    /// Step [s]: how long the unit force is held, and the time between samples
    #[arg(long, value_name = "S", default_value_t = 1e-3, allow_negative_numbers = true, requires = "dense")]
    pub step: f64,
    /// Sample: displacement at the end of the step (exact), or the mean of its middle and end (as in the paper, not passive)
    #[arg(long, value_enum, default_value_t = SamplingOption::End, requires = "dense")]
    pub sampling: SamplingOption,
    /// Method: from the modes and residual compliance, or by time integration of the whole mesh
    #[arg(long, value_enum, default_value_t = MethodOption::ClosedForm, requires = "dense")]
    pub method: MethodOption,
    /// Integration steps per sample of --method transient
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000), requires = "dense")]
    pub substeps: u32,
    /// Touchable nodes, where force may enter: surface, all, region:NAME, nodes:1,5-9, a group of the mesh, or a condition such as 'x<0.01'; parts joined by & must all hold; may be repeated
    #[arg(long, value_name = "NODES", default_value = "surface", requires = "dense")]
    pub touchable: Vec<String>,
    /// Observed nodes, whose displacement is recorded: as --touchable
    #[arg(long, value_name = "NODES", default_value = "surface", requires = "dense")]
    pub observed: Vec<String>,
    /// Number format
    #[arg(long, value_enum, default_value_t = NumberOption::F32, requires = "dense")]
    pub dtype: NumberOption,
    /// Packing: zstd makes the store smaller, none lets a run map it as it lies
    #[arg(long, value_enum, default_value_t = CompressionOption::Zstd, requires = "dense")]
    pub compression: CompressionOption,
    /// Write only the shards K, K+N, K+2N, … so that N machines share the work; K counts from 1 to N or from 0
    #[arg(long, value_name = "K/N", value_parser = part, requires = "dense")]
    pub shard: Option<Part>,
    /// Columns (touchable degrees of freedom) per shard; by default as many as make 256 MB, at most 48, at which the work is quickest
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), requires = "dense")]
    pub columns_per_shard: Option<u64>,
    /// Memory to stay within, as 4GB or 500MB: makes shards smaller
    #[arg(long, value_name = "SIZE", value_parser = memory, requires = "dense")]
    pub limit_memory: Option<u64>,
}

/// Option of [`Sampling`].
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum SamplingOption {
    /// End of the step.
    End,
    /// Mean of middle and end.
    Mean,
}

/// Option of [`Method`].
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum MethodOption {
    /// From modes and residual compliance.
    ClosedForm,
    /// By time integration.
    Transient,
}

/// Option of [`Number`].
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum NumberOption {
    /// Single precision.
    F32,
    /// Double precision.
    F64,
}

/// Option of [`Compression`].
#[derive(ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
pub enum CompressionOption {
    /// Zstandard after byte shuffling.
    Zstd,
    /// None.
    None,
}

/// Size of a shard [bytes], and the number of columns from which on computing is no faster.
const SHARD_BYTES: u64 = 256 << 20;
const MAX_COLUMNS: u64 = 48;

fn part(text: &str) -> Result<Part, String> {
    let numbers =
        text.split_once('/').and_then(|(k, n)| Some((k.trim().parse().ok()?, n.trim().parse().ok()?)));
    match numbers {
        Some((number, of)) if of >= 1 && number <= of => Ok(Part { number, of }),
        _ => Err("expected K/N with K from 1 to N (or from 0 to N−1), as in 3/8".into()),
    }
}

fn memory(text: &str) -> Result<u64, String> {
    let lower = text.trim().to_ascii_lowercase();
    let at = lower.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(lower.len());
    let factor = match lower[at..].trim() {
        "" | "b" => 1.0,
        "k" | "kb" => 1e3,
        "m" | "mb" => 1e6,
        "g" | "gb" => 1e9,
        "t" | "tb" => 1e12,
        "kib" => 1024.0,
        "mib" => 1_048_576.0,
        "gib" => 1_073_741_824.0,
        _ => f64::NAN,
    };
    match lower[..at].parse::<f64>().map(|number| number * factor) {
        Ok(bytes) if bytes >= 1.0 => Ok(bytes as u64),
        _ => Err("expected a size such as 4GB, 500MB or 2GiB".into()),
    }
}

/// Options of a table, checked before the body is computed.
pub struct TableCommand<'a> {
    arguments: &'a TableArguments,
    location: Location,
    samples: usize,
    touchable: Vec<NodeSelection>,
    observed: Vec<NodeSelection>,
}

impl<'a> TableCommand<'a> {
    /// Check the options that ask for a table; none if no table is wanted.
    pub fn new(arguments: &'a TableArguments, mesh: &Mesh) -> Result<Option<Self>, Failure> {
        let Some(output) = &arguments.dense else { return Ok(None) };
        let (step, duration) = (arguments.step, arguments.duration);
        if !(step > 0.0 && step <= 1.0) {
            return Err(Failure(format!("--step is {step} s, expected above 0 and at most 1")));
        }
        let samples = (duration / step).round();
        if !(1.0..=1e8).contains(&samples) {
            return Err(Failure(format!(
                "--duration is {duration} s, expected at least one --step of {step} s, and at most 1e8 of them"
            )));
        }
        let location = Location::parse(output);
        if location.folder().is_some_and(|folder| folder.is_file()) {
            return Err(Failure(format!("cannot write {location}: it is a file, and a store is a folder")));
        }
        let chosen = |option: &str, texts: &[String]| -> Result<Vec<NodeSelection>, Failure> {
            Ok(texts.iter().map(|text| select_nodes(mesh, option, text)).collect::<Result<_, _>>()?)
        };
        Ok(Some(Self {
            arguments,
            location,
            samples: samples as usize,
            touchable: chosen("--touchable", &arguments.touchable)?,
            observed: chosen("--observed", &arguments.observed)?,
        }))
    }

    /// Part of a recording that the table needs; `also_recording` when one is written beside it.
    pub fn extent(&self, also_recording: bool) -> RecordExtent {
        match (also_recording, self.arguments.method) {
            (true, _) => RecordExtent::Full,
            (false, MethodOption::ClosedForm) => RecordExtent::NoCertificate,
            (false, MethodOption::Transient) => RecordExtent::NoModes,
        }
    }

    /// Record what is missing of the table.
    pub fn record(&self, recorded: &RecordedBody, progress: &mut Bars) -> Result<TableStore, Failure> {
        let arguments = self.arguments;
        let parameters = TableParameters {
            step_s: arguments.step,
            samples: self.samples,
            sampling: match arguments.sampling {
                SamplingOption::End => Sampling::End,
                SamplingOption::Mean => Sampling::Mean,
            },
            method: match arguments.method {
                MethodOption::ClosedForm => TableMethod::ClosedForm,
                MethodOption::Transient => TableMethod::Transient { substeps: arguments.substeps },
            },
            touchable_nodes: union_of_nodes(recorded, &self.touchable),
            observed_nodes: union_of_nodes(recorded, &self.observed),
        };
        let failed = |e: palpate_fem::table::TableError| Failure(e.to_string());
        let recorder = TableRecorder::new(recorded, &parameters).map_err(failed)?;
        let content = self.content(recorded, &parameters, &recorder);
        let store = TableStore::create(&self.location, content, || recorder.gravity())?;
        let part = arguments.shard.unwrap_or(Part::ALL);
        let missing = store.missing(part)?;
        check_existing(&store, part, &missing, progress)?;
        let at_once = self.shards_at_once(&store, &recorder)?;

        let columns: usize = missing.iter().map(|&shard| store.columns_of(shard).len()).sum();
        if columns > 0 {
            progress.begin("impulse responses", columns as u64);
        }
        let counter = progress.counter();
        let block = block_width(store.content().attributes.columns_per_shard);
        for shards in missing.chunks(at_once) {
            let compute = |&shard: &usize| {
                (shard, recorder.columns(store.columns_of(shard), block, &|done| counter(done)))
            };
            let blocks: Vec<_> = shards.par_iter().map(compute).collect();
            for (shard, block) in blocks {
                store.write_shard(shard, block)?;
            }
        }
        progress.finish();
        store.tidy()?;
        Ok(store)
    }

    fn content(
        &self,
        recorded: &RecordedBody,
        parameters: &TableParameters,
        recorder: &TableRecorder<'_>,
    ) -> TableContent {
        let number = match self.arguments.dtype {
            NumberOption::F32 => Number::F32,
            NumberOption::F64 => Number::F64,
        };
        let column_bytes = (recorder.column_length() * number.bytes()) as u64;
        let mut columns_per_shard = (SHARD_BYTES / column_bytes.max(1)).clamp(1, MAX_COLUMNS);
        if columns_per_shard > 3 {
            // Whole nodes.
            columns_per_shard -= columns_per_shard % 3;
        }
        if let Some(limit) = self.arguments.limit_memory {
            while columns_per_shard > 1 && needed_bytes(recorder, columns_per_shard, number) > limit {
                columns_per_shard -= 1;
            }
        }
        let recording: Metadata = Metadata {
            // The certificate is the modal form's.
            certificate: match self.arguments.method {
                MethodOption::ClosedForm => recorded.recording.metadata.certificate.clone(),
                MethodOption::Transient => None,
            },
            ..recorded.recording.metadata.clone()
        };
        let method = match parameters.method {
            TableMethod::ClosedForm => {
                let residual = match &recorded.recording.residual {
                    palpate::ResidualCompliance::None => "no residual compliance",
                    _ => "residual compliance",
                };
                format!("closed-form, {} modes and {residual}", recorded.recording.modes.len())
            }
            TableMethod::Transient { substeps } => format!(
                "transient, order 5, substeps {substeps}: follows waves up to {:.0} Hz to 1 % over 0.1 s",
                recorder.resolved_frequency_hz().unwrap_or_default()
            ),
        };
        let centre = DVec3::from_array(recorded.recording.metadata.mass.center_of_mass_m);
        let nodes = recorded.nodes();
        let observed_positions = parameters.observed_nodes.iter().map(|&node| nodes[node as usize] - centre);
        TableContent {
            attributes: TableAttributes {
                store_version: palpate_store::STORE_VERSION,
                step_s: parameters.step_s,
                sampling: TableAttributes::sampling_text(parameters.sampling),
                method,
                columns_per_shard: self.arguments.columns_per_shard.unwrap_or(columns_per_shard),
                compression: match self.arguments.compression {
                    CompressionOption::Zstd => Compression::Zstd,
                    CompressionOption::None => Compression::None,
                },
                recording,
            },
            number,
            samples: parameters.samples,
            touchable_dofs: recorder.touchable_dofs(),
            observed_dofs: recorder.observed_dofs(),
            observed_positions: observed_positions.collect(),
            surface: recorded.recording.surface.clone(),
            // Only a new store needs it, and then it is long work.
            gravity: None,
        }
    }

    /// Number of shards that are computed at once, so that every core has a block of columns; refuses work that would go beyond
    /// the limit, or beyond the memory that there is.
    fn shards_at_once(&self, store: &TableStore, recorder: &TableRecorder<'_>) -> Result<usize, Failure> {
        let content = store.content();
        let columns = content.attributes.columns_per_shard;
        let needed = |shards: u64| needed_bytes(recorder, shards * columns, content.number);
        let limit = self.arguments.limit_memory.unwrap_or(u64::MAX);
        if needed(1) > limit {
            return Err(Failure(format!(
                "--limit-memory is {:.2} GB; shards of {columns} columns need {:.2} GB here. Allow more, record less \
                 (--duration, --observed), or begin a new store with smaller --columns-per-shard",
                limit as f64 / 1e9,
                needed(1) as f64 / 1e9
            )));
        }
        let room =
            |shards: u64| palpate_fem::check_memory(needed(shards).saturating_sub(used_bytes()) as f64);
        room(1).map_err(|e| Failure(e.to_string()))?;
        let wanted = (block_width(columns) * rayon::current_num_threads()).div_ceil(columns as usize) as u64;
        let fits = |&shards: &u64| needed(shards) <= limit && room(shards).is_ok();
        Ok((1..=wanted).rev().find(fits).unwrap_or(1) as usize)
    }
}

/// Memory [bytes] while a shard of so many columns is made: the process as it is, the columns in f64, and their stored
/// form before and after packing.
fn needed_bytes(recorder: &TableRecorder<'_>, columns: u64, number: Number) -> u64 {
    let table = columns * (recorder.column_length() * 3 * number.bytes()) as u64;
    used_bytes() + recorder.working_bytes(columns as usize, block_width(columns)) as u64 + table
}

/// Columns that are computed together: a property of the store, so that its bits don't depend on who writes it.
fn block_width(columns_per_shard: u64) -> usize {
    COLUMN_BLOCK.min(columns_per_shard as usize)
}

/// Memory [bytes] that this process uses, where the system tells.
fn used_bytes() -> u64 {
    let pages = std::fs::read_to_string("/proc/self/statm").ok();
    let resident = pages.and_then(|text| text.split_whitespace().nth(1)?.parse::<u64>().ok());
    4096 * resident.unwrap_or(0)
}

/// Checks the shards that exist before others are added.
fn check_existing(
    store: &TableStore,
    part: Part,
    missing: &[usize],
    progress: &mut Bars,
) -> Result<(), Failure> {
    let standing: Vec<usize> =
        (0..store.shards()).filter(|shard| part.holds(*shard) && !missing.contains(shard)).collect();
    if standing.is_empty() {
        return Ok(());
    }
    progress.begin("checking what is there", standing.len() as u64);
    for shard in standing {
        store.check_shard(shard)?;
        progress.advance(1);
    }
    progress.finish();
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_parts_are_read_as_people_write_them() {
        assert_eq!(memory("4GB"), Ok(4_000_000_000));
        assert_eq!(memory("1.5 GiB"), Ok(1_610_612_736));
        assert_eq!(memory("1000"), Ok(1000));
        assert!(memory("4 apples").is_err() && memory("-1GB").is_err() && memory("nan").is_err());
        assert_eq!(part("3/8"), Ok(Part { number: 3, of: 8 }));
        assert!(part("9/8").is_err() && part("1/0").is_err() && part("half").is_err());
    }
}
