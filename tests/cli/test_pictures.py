"""Where a picture cannot be, one line says so before any work; nothing is left behind."""

import pytest
from matplotlib.figure import Figure

from thrustd.__main__ import main
from thrustd.core.errors import UsageError
from thrustd.diagnose.compare import pictures
from thrustd.diagnose.compare.pictures import dependence_picture
from thrustd.replay.picture import FlightPicture

VERBS = {  # none of these files is there: the picture is judged before they are looked for
    "replay": ("replay", "gone.mcap", "--picture"),
    "effects": ("effects", "axial_inertia", "--picture"),
    "compare": ("compare", "gone.json", "gone.csv", "--pictures"),
    "diagnose": ("diagnose", "gone.json", "gone.csv", "--pictures"),
}


def refused(capsys, verb, path):
    arguments = VERBS[verb]
    assert main([*arguments, str(path)]) == 2
    out, err = capsys.readouterr()
    assert (out, len(err.splitlines())) == ("", 1)
    assert str(path) in err
    return err


@pytest.mark.parametrize("verb", ["replay", "effects"])
def test_a_picture_is_a_png_in_a_folder_that_is_there(tmp_path, capsys, verb):
    (tmp_path / "folder.png").mkdir()
    for name in ("p.xyz", "p", "folder.png"):
        assert ".png" in refused(capsys, verb, tmp_path / name)
    assert "no folder" in refused(capsys, verb, tmp_path / "gone" / "p.png")
    assert [path.name for path in tmp_path.iterdir()] == ["folder.png"]


@pytest.mark.parametrize("verb", ["compare", "diagnose"])
def test_pictures_go_where_a_folder_can_be_made(tmp_path, capsys, verb):
    (tmp_path / "file").write_text("")
    for path in (tmp_path / "file", tmp_path / "file" / "below"):
        assert "expected a folder" in refused(capsys, verb, path)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("verb", sorted(VERBS))
def test_a_folder_that_takes_no_files_is_told(capsys, verb):
    assert "cannot be written" in refused(capsys, verb, "/dev/null/p.png")


def test_trying_out_leaves_nothing_behind(tmp_path, capsys):
    assert main([*VERBS["compare"], str(tmp_path / "new" / "pictures")]) == 2
    assert "gone.json" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_picture_that_cannot_be_finished_leaves_the_one_before(tmp_path, capsys, monkeypatch):
    path = tmp_path / "signature.png"
    path.write_bytes(b"the one before")

    def full_disk(figure, target, **how):
        with open(target, "wb") as file:
            file.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Figure, "savefig", full_disk)
    monkeypatch.setattr(pictures, "_draw_dependence", lambda *_: None)
    assert "No space left" in refused(capsys, "effects", path)
    with pytest.raises(UsageError, match="No space left"):
        FlightPicture().save(path, "flight", {})
    with pytest.raises(UsageError, match="No space left"):
        dependence_picture([None], path)
    assert path.read_bytes() == b"the one before"
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
