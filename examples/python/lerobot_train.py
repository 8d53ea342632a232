"""lerobot-train, with action chunks that are read without the images of their rows; for LeRobot 0.6.1 and earlier versions of the 0.6 series.

LeRobotDataset reads the actions of a chunk from whole rows, and so decodes all images of all of them (issue 4392 of LeRobot). This reads
the requested columns alone, as LeRobot does after its pull request 4314. The items are the same. The arguments are those of lerobot-train.
"""

from typing import Any

import torch
from lerobot.datasets.dataset_reader import DatasetReader
from lerobot.scripts import lerobot_train


def query_columns(reader: Any, query_indices: dict[str, list[int]]) -> dict[str, torch.Tensor]:
    """Rows of each key, in place of `DatasetReader._query_hf_dataset`."""
    # A reader has another data set after it was loaded again.
    if getattr(reader, "column_source", None) is not reader.hf_dataset:
        reader.column_source, reader.columns = reader.hf_dataset, {}
    places, found = reader._absolute_to_relative_idx, {}
    for key, indices in query_indices.items():
        if key in reader._meta.video_keys:
            continue
        if key not in reader.columns:
            reader.columns[key] = reader.hf_dataset.select_columns([key])
        rows = indices if places is None else [places[index] for index in indices]
        found[key] = torch.stack(reader.columns[key][rows][key])
    return found


DatasetReader._query_hf_dataset = query_columns

if __name__ == "__main__":
    lerobot_train.main()
