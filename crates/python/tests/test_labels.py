"""Vessels from segmentations."""

from pathlib import Path

import numpy as np
import pytest

import endowire

LABELS = Path(endowire.assets_path()) / "ct" / "abdomen_labels.nii.gz"


def test_several_labels_are_one_vessel_with_openings():
    vessel = endowire.Vessel.from_labels(LABELS, [52, 65, 66])
    radii = [opening["radius_mm"] for opening in vessel.openings]
    assert radii == pytest.approx([9.0, 5.0, 5.0, 3.3], rel=0.15)
    assert len(vessel.targets) == 3
    one = endowire.Vessel.from_labels(LABELS, 65)
    assert len(one.openings) == 2
    with pytest.warns(UserWarning, match="closed"):
        closed = endowire.Vessel.from_labels(LABELS, np.array([52]), ends="none")
    assert closed.openings == []


@pytest.mark.parametrize(
    ("label", "options", "message"),
    [
        (51, {}, "label = 51: has no voxel: it has the labels 52"),
        (0, {}, "background"),
        ([], {}, "name at least one"),
        (52, {"parts": "some"}, "must be largest or all"),
        (52, {"ends": "some"}, "must be all, border or none"),
    ],
)
def test_wrong_labels_are_refused(label, options, message):
    with pytest.raises(endowire.InputError, match=message):
        endowire.Vessel.from_labels(LABELS, label, **options)


def test_a_tomogram_is_no_label_map():
    with pytest.raises(endowire.InputError, match="is no label map"):
        endowire.Vessel.from_labels(LABELS.with_name("abdomen.nii.gz"), 1)
