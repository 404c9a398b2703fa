from benchmarks.tracing_roads import RoadFigures, road_rows


def figures(count, width=1.0, refusal="", holds=None):
    return [RoadFigures("0 plain, 20.0 px", refusal, "walls", width, width, 0.0, 0.1, holds)] * count


def missed(seen):
    return [row.name.split(",")[0] for row in road_rows(seen) if row.missed]


def test_bars_of_refusals_widths_and_intervals():
    refused = figures(10, refusal="no")
    assert missed([*figures(190, 4.9), *refused]) == []
    assert missed([*figures(189), *refused, *refused[:1]]) == ["refused"]
    assert missed([*figures(95, 5.1), *figures(95, -5.1), *refused]) == ["mean width"]
    assert missed([*figures(95, holds=True), *figures(5, holds=False), *figures(50)]) == []
    assert missed(figures(100, holds=True)) == ["intervals that hold the true width"]
    assert missed(refused) == ["refused", "mean width"]
