//! Scenes for interactive use: texts with pointers, changes of their settings, and the library of built-in scenes, scene files and uploads.

#[cfg(feature = "native")]
mod built_in;
mod falling;
#[cfg(feature = "native")]
mod instruments;
#[cfg(feature = "recording")]
mod mesh_upload;
mod pointers;
#[cfg(feature = "native")]
mod scene_library;
mod settings;
#[cfg(feature = "native")]
mod soft_scenes;
mod touchable;

#[cfg(feature = "native")]
pub use built_in::{BUILT_IN_SCENES, BuiltInScene, paper_cube_recipe};
pub use falling::falling_scene;
#[cfg(feature = "recording")]
pub use mesh_upload::MeshUpload;
#[cfg(feature = "native")]
pub use scene_library::{OpenedScene, SceneLibrary};
pub use settings::SettingsChange;
pub use touchable::{TouchableScene, read_touchable_scene};
