from ikns.live.warm_up import compiled_before, warm_up


def test_everything_is_compiled_or_loaded_with_progress():
    said = []
    assert warm_up(lambda *progress: said.append(progress)) > 0
    assert said[0] == ("compiling", 0, said[0][2])
    assert [done for _, done, _ in said] == list(range(said[0][2] + 1))
    assert compiled_before()
