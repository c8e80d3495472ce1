//! Logs of a scene: the files, names and facts that a log carries so that it can be replayed anywhere.

use crate::error::{SceneError, SceneErrorKind};
use crate::log_facts::log_facts;
use crate::scene::Scene;
use palpate::{Input, Model, State};
use palpate_haptics::SceneNames;
use palpate_haptics::log::{LogSender, LogWriter};
use palpate_mesh::read_regular_file;
use std::io::{Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Content of a scene that its logs carry.
pub struct SceneLog {
    model: Arc<Model>,
    names: SceneNames,
    input: Input,
    /// Files that the scene was read from, the scene file first.
    inputs: Vec<PathBuf>,
    /// Text of the scene, where it is not that of its file.
    text: Option<String>,
}

impl SceneLog {
    /// Content for a scene, whose text may differ from its file's.
    pub fn new(scene: &Scene, text: Option<String>) -> Self {
        Self {
            model: scene.model.clone(),
            names: scene.names(),
            input: scene.input_at(0.0),
            inputs: scene.inputs.clone(),
            text,
        }
    }

    /// Files that the scene was read from, the scene file first.
    pub fn inputs(&self) -> Vec<&Path> {
        self.inputs.iter().map(PathBuf::as_path).collect()
    }

    /// Step of the scene [s].
    pub fn step_s(&self) -> f64 {
        self.model.parameters().step_s
    }

    /// Folders among the inputs: stores, which logs do not carry; a replay needs them where they are.
    pub fn stores_left_out(&self) -> Vec<&Path> {
        self.inputs().into_iter().filter(|input| input.is_dir()).collect()
    }

    /// Begins a log from a state.
    ///
    /// # Errors
    /// When an input cannot be read, or the log cannot be written.
    pub fn begin<W: Write + Seek>(
        &self,
        file: W,
        state: &State,
    ) -> Result<(LogSender, LogWriter<W>), SceneError> {
        let scene = self.inputs.first().map(|path| path.display().to_string()).unwrap_or_default();
        let facts = log_facts(scene, self.step_s());
        let start = (&*self.model, state, &self.input);
        LogWriter::new(file, self.names.clone(), facts, &self.files()?, start)
            .map_err(|error| SceneError::new(SceneErrorKind::Log, error))
    }

    /// Contents of the input files, by name.
    fn files(&self) -> Result<Vec<(String, Vec<u8>)>, SceneError> {
        let mut files: Vec<(String, Vec<u8>)> = Vec::new();
        for (at, input) in self.inputs.iter().enumerate() {
            let name = input.display().to_string();
            if input.is_dir() || files.iter().any(|(known, _)| *known == name) {
                continue;
            }
            let bytes = match &self.text {
                Some(text) if at == 0 => text.clone().into_bytes(),
                _ => read_regular_file(input).map_err(|error| SceneError::io("read", input, &error))?,
            };
            files.push((name, bytes));
        }
        Ok(files)
    }
}
