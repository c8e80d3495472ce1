//! Names of the parts of a scene, as logs have them.

/// Names of a scene's parts, in the model's order.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SceneNames {
    /// Names of the objects.
    pub objects: Vec<String>,
    /// Names of the devices.
    pub devices: Vec<String>,
    /// Names of the planes and obstacles.
    pub obstacles: Vec<String>,
    /// Names of the clamps.
    pub clamps: Vec<String>,
}
