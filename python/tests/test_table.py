"""NumPy and Arrow see the same memory."""

import gc

import duckdb
import numpy as np
import pandas
import polars
import pyarrow
import pytest
from conftest import TWO

from cohaptic import Scene, Table, campaign


@pytest.fixture(scope="module")
def trajectory() -> Table:
    return Scene(TWO).run().trajectory


def address(array: np.ndarray) -> int:
    return array.__array_interface__["data"][0]


def test_no_number_is_copied(trajectory: Table) -> None:
    arrow = pyarrow.table(trajectory)
    for name in trajectory:
        column = arrow[name].chunk(0)
        codes = column.indices if pyarrow.types.is_dictionary(column.type) else column
        places = {
            address(trajectory[name]),
            address(trajectory[name]),
            trajectory.address(name),
            codes.buffers()[1].address,
        }
        assert len(places) == 1, name
    assert len({trajectory.address(name) for name in trajectory}) == len(trajectory.keys())


def test_arrays_cannot_be_written_to(trajectory: Table) -> None:
    with pytest.raises(ValueError, match="read-only"):
        trajectory["xo"][0] = 1.0
    with pytest.raises(ValueError, match="WRITEABLE"):
        trajectory["xo"].setflags(write=True)


def test_memory_lives_as_long_as_any_array() -> None:
    run = Scene(TWO).run()
    expected = run.trajectory["xo"].tolist()
    array, arrow = run.trajectory["xo"], pyarrow.table(run.trajectory)["xo"]
    del run
    gc.collect()
    Scene(TWO).run()
    assert array.tolist() == expected == arrow.to_pylist()


def test_frames_of_others_have_the_same_numbers(trajectory: Table) -> None:
    columns = {name: trajectory.decode(name).tolist() for name in trajectory}
    assert pyarrow.table(trajectory).to_pydict() == columns
    frame = polars.DataFrame(trajectory)
    assert frame.columns == list(trajectory)
    assert frame.to_dict(as_series=False) == columns
    frame = pandas.DataFrame(dict(trajectory))
    assert frame["xo"].tolist() == columns["xo"]
    frame = pandas.DataFrame.from_arrow(trajectory)
    assert {name: frame[name].tolist() for name in frame} == columns


def test_duckdb_queries_a_table_by_its_name(trajectory: Table) -> None:
    found = duckdb.sql("select * from trajectory")
    assert found.columns == list(trajectory)
    assert found.fetchall() == list(zip(*(trajectory.decode(name).tolist() for name in trajectory), strict=True))
    largest = duckdb.sql("select peer, max(xo) from trajectory group by peer order by peer").fetchall()
    place, peers = trajectory["xo"], trajectory.decode("peer")
    assert largest == [(name, place[peers == name].max()) for name in ("left", "right")]


def test_a_schema_names_types(trajectory: Table) -> None:
    schema = pyarrow.schema(trajectory)
    assert schema.field("t").type == pyarrow.float64()
    assert schema.field("peer").type == pyarrow.dictionary(pyarrow.int32(), pyarrow.string())


def test_an_unknown_column_is_a_key_error(trajectory: Table) -> None:
    with pytest.raises(KeyError, match="zo"):
        trajectory["zo"]
    assert "zo" not in trajectory
    assert trajectory.rows == 1000


def test_a_run_without_rows_says_so() -> None:
    run = Scene(TWO).run(record=False)
    with pytest.raises(ValueError, match="record=True"):
        _ = run.trajectory
    with pytest.raises(ValueError, match="record=True"):
        run.plot()
    assert run._repr_svg_() is None
    assert run.links["offered"].tolist() == [63, 63]


def test_a_picture_is_saved_as_it_is_shown(tmp_path) -> None:
    run = Scene(TWO).run()
    picture = run.plot("forces")
    picture.save(tmp_path / "forces.svg")
    assert (tmp_path / "forces.svg").read_text(encoding="utf-8") == picture._repr_svg_()
    assert run._repr_svg_() == run.plot("positions").svg
    with pytest.raises(ValueError, match="expected one of positions, forces, network"):
        run.plot("views")


def test_a_frame_of_pandas_has_the_same_numbers_and_names(trajectory: Table) -> None:
    frame = trajectory.to_pandas()
    assert list(frame) == list(trajectory)
    for name in trajectory:
        assert frame[name].tolist() == trajectory.decode(name).tolist()
    frame.iloc[0, 0] = frame.iloc[1, 0]
    assert frame.attrs["units"] == {}
    names = Scene(TWO).run().packets.to_pandas()["link"]
    assert isinstance(names.dtype, pandas.CategoricalDtype)


def test_a_column_is_named_by_the_key_that_was_varied_and_has_its_unit() -> None:
    scene = Scene(TWO).set("scene.duration", "100ms")
    vary = {
        "link.delay": ["8ms", "16ms"],
        "link.loss": ["0%", "10%"],
        "coordination.stiffness": [500, 1000],
        "coordination.damping": [2.5],
    }
    table = campaign(scene, vary=vary)
    assert set(vary) < set(table)
    assert sorted(set(table["link.delay"].tolist())) == [8.0, 16.0]
    assert sorted(set(table["coordination.stiffness"].tolist())) == [500, 1000]
    units = {"link.delay": "ms", "link.loss": "%", "coordination.stiffness": "N/m", "coordination.damping": "N·s/m"}
    assert {name: table.unit(name) for name in vary} == units
    assert table.unit("run") == ""
    assert table.to_pandas().attrs["units"] == units
    assert pyarrow.table(table).schema.field("link.delay").metadata == {b"unit": b"ms"}
    with pytest.raises(KeyError):
        table.unit("link.delay_ms")
