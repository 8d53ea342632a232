//! Project folders with small scripts: the input of the tests of the binary and of the library.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use serde_json::Value;

pub mod client;

/// A folder of a test.
pub struct Project {
    pub folder: PathBuf,
    /// True if the folder stays after the test.
    pub is_kept: bool,
}

impl Drop for Project {
    fn drop(&mut self) {
        if !self.is_kept {
            let _ = fs::remove_dir_all(&self.folder);
        }
    }
}

impl Project {
    pub fn new(files: &[(&str, &str)]) -> Self {
        let project = Self { folder: tempfile::tempdir().expect("a folder").keep(), is_kept: false };
        files.iter().for_each(|(path, text)| project.write(path, text.as_bytes()));
        project
    }

    pub fn write(&self, path: &str, bytes: &[u8]) {
        let path = self.path(path);
        fs::create_dir_all(path.parent().expect("a folder above")).expect("made");
        fs::write(path, bytes).expect("written");
    }

    pub fn path(&self, path: &str) -> PathBuf {
        self.folder.join(path)
    }

    pub fn text(&self, path: &str) -> String {
        fs::read_to_string(self.path(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
    }

    pub fn json(&self, path: &str) -> Value {
        serde_json::from_str(&self.text(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
    }

    /// Parses JSON lines. Every line must be complete.
    pub fn lines(&self, path: &str) -> Vec<Value> {
        let text = self.text(path);
        assert!(text.is_empty() || text.ends_with('\n'), "{path} ends in a torn line");
        text.lines().map(|line| serde_json::from_str(line).expect("a line of JSON")).collect()
    }
}

/// All files below a folder by path.
pub fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(dir) = folders.pop() {
        for entry in fs::read_dir(&dir).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("below it").display().to_string();
                found.insert(name, fs::read(&path).expect("read"));
            }
        }
    }
    found
}

/// A suite of one soft cube on a floor, with replaceable parts.
pub struct Small {
    pub shape: &'static str,
    pub material: &'static str,
    pub at: &'static str,
    pub task: &'static str,
    pub expert: &'static str,
}

impl Default for Small {
    fn default() -> Self {
        Self {
            shape: "softvt.shape.box { size = { 0.04, 0.04, 0.04 } }:grounded()",
            material: "youngs_pa = 2e4, poisson = 0.3, density = 300",
            at: "at = { 0, 0.1 }",
            task: "budget_steps = 40",
            expert: "arm:wait(1)",
        }
    }
}

impl Small {
    /// Line 2 is the shape, 3 the material, 6 the place, 11 the task, 12 the expert.
    pub fn text(&self) -> String {
        let Self { shape, material, at, task, expert } = self;
        format!(
            r#"local floor = softvt.asset {{ name = "floor", shape = softvt.shape.box {{ size = {{ 1, 1, 0.05 }} }}:translate(0, 0, -0.025), body = softvt.static {{}} }}
local shape = {shape}
local cube = softvt.asset {{ name = "cube", shape = shape, body = softvt.soft {{ {material} }} }}
local layout = softvt.layout("one", function(scene)
  scene:add {{ name = "floor", asset = floor, position = {{ 0, 0, 0 }} }}
  scene:add {{ name = "cube", asset = cube, {at} }}
  scene:add {{ name = "post", asset = floor, position = {{ 0, 2, 0 }} }}
end)
return softvt.suite {{ name = "one", object_type = "deformable", tasks_differ_in = "spatial", episodes = 1, tasks = {{
  softvt.task {{ prompt = "wait", layout = layout, goal = softvt.on {{ object = "cube", target = "post" }},
    {task},
    expert = function(arm, scene) {expert} end }},
}} }}
"#
        )
    }

    pub fn project(&self) -> Project {
        Project::new(&[("x.lua", &self.text())])
    }
}
