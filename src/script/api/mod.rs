//! Bindings: everything a script can reach as `softvt.…`, one file per domain.

pub(crate) mod catalogue;
pub(crate) mod catalogue_classes;
pub(crate) mod catalogue_conditions;
pub(crate) mod catalogue_joints;
pub(crate) mod catalogue_policy;
pub(crate) mod catalogue_shapes;
pub(crate) mod catalogue_visuals;
pub(crate) mod catalogue_world;
pub(crate) mod classes_world;
pub(crate) mod envelope;
pub(crate) mod image;
pub(crate) mod joints;
pub(crate) mod observation;
pub(crate) mod orientation;
pub(crate) mod pose;
pub(crate) mod scene;
pub(crate) mod shapes;
pub(crate) mod sim;
pub(crate) mod touch;
pub(crate) mod view;
pub(crate) mod visuals;
pub(crate) mod world;
