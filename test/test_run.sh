# Tests test/run.sh, by programs in place of unit tests and with a script of its own.
. test/lib.sh
mkdir -p "$T/test" "$T/units" && cp test/run.sh "$T/test" && cd "$T" || exit 1
echo 'echo "ok 1 - script"' >test/test_script.sh
unit() { # NAME: what is read is the program
    { echo '#!/bin/sh'; cat; } >"units/$1" && chmod +x "units/$1"
}
unit good <<'END'
echo "ok 1 - good"
END
unit bad <<'END'
echo "ok 1 - good"; echo "not ok 2 - bad"; echo "the reason"
exit 1
END
unit skips <<'END'
echo "ok 1 - good"; echo "not ok 2 # SKIP as root"
END
unit silent </dev/null
unit crashed <<'END'
echo "ok 1 - good"
kill -SEGV $$
END
unit strange <<'END'
echo "ok 1 - good"
exit 255
END

suite() { # STATUS END UNIT...: it ends with this line
    status=$1 end=$2; shift 2
    run "$status" env UNITS="$*" sh test/run.sh
    good=$?
    echo "$out"; echo "$err"
    [ $good -eq 0 ] && [ -z "$err" ] && [ "$(echo "$out" | tail -n 1)" = "$end" ]
}
check "all pass" suite 0 "2 passed, 0 failed" units/good
mkdir level && cp units/good level
check "two of the same name" suite 0 "3 passed, 0 failed" units/good level/good
check "no units" suite 0 "1 passed, 0 failed"
check "one that does not apply" suite 0 "2 passed, 0 failed" units/skips
for unit in bad crashed strange; do
    check "one is $unit" suite 1 "3 passed, 1 failed" units/$unit units/good
done
for unit in silent missing; do
    check "one is $unit" suite 1 "2 passed, 1 failed" units/$unit units/good
done
together() { # also where the units run at the same time
    many=
    for i in 1 2 3 4 5 6 7 8; do cp units/bad "units/bad$i" && many="$many units/bad$i"; done
    suite 1 "9 passed, 8 failed" $many && [ "$(echo "$out" | grep -A 2 '^bad' | grep -c '^    the reason')" -eq 8 ] &&
        echo "$out" | awk '/^bad/ { if (lines % 3) exit 1; lines = 0 } /^bad|^    / { lines++ }'
}
check "the lines of a unit stay together" together
beside() { # before the other script
    echo 'echo "ok 1 - beside"; echo "not ok 2 - bad"' >test/test_omit.sh
    suite 1 "3 passed, 1 failed" units/good &&
        [ "$(echo "$out" | grep -o '^test_[a-z]*' | tr '\n' ' ')" = "test_omit test_script " ]
}
check "a script that runs beside units" beside
finish
