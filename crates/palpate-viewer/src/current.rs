//! Scene that is shown now.

use crate::protocol::ServerMessage;
use crate::scene_provider::ViewerScene;
use std::sync::Arc;

/// Scene with the number of its start.
pub(crate) struct CurrentScene {
    /// Number that grows at each start of a scene.
    pub generation: u32,
    pub scene: ViewerScene,
    /// `scene` message, as JSON.
    pub message: Arc<str>,
}

impl CurrentScene {
    /// Scene with its encoded message.
    pub fn new(generation: u32, scene: ViewerScene) -> Self {
        let message = ServerMessage::Scene { generation, scene: &scene.description }.to_json().into();
        Self { generation, scene, message }
    }
}
