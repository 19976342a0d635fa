// What a figure draws, and what a table says, as CSV: the same text as figure_data.py, from what
// the page holds. `figureData(data, layout)` of plotly.js, `tableData(header, rows)` of cells.
"use strict";
const { figureData, tableData } = (() => {
  const COLUMNS = [
    "panel", "panel_title", "trace", "x_axis", "x", "x_name", "x_plus", "x_minus",
    "y_axis", "y", "y_name", "y_plus", "y_minus", "z_axis", "z", "value_of", "value", "size",
    "base", "width", "text",
  ];
  const MATRIX = ["heatmap", "contour"];
  const ARRAYS = {
    i1: Int8Array, u1: Uint8Array, i2: Int16Array, u2: Uint16Array, i4: Int32Array,
    u4: Uint32Array, f4: Float32Array, f8: Float64Array,
  };
  const XYZ = ["x", "y", "z"];

  function figureData(data, layout) {
    const rows = data.flatMap(each => ofTrace(each, layout));
    rows.push(...ofShapes(layout), ...ofNotes(layout));
    let hovers = 0;
    for (const row of rows) {
      hovers = Math.max(hovers, Object.keys(row).filter(name => name.startsWith("hover_")).length);
    }
    const names = [...COLUMNS, ...Array.from({length: hovers}, (_, at) => `hover_${at + 1}`)];
    const shown = names.filter(name => rows.some(row => row[name]));
    return csv([shown, ...rows.map(row => shown.map(name => row[name] || ""))]);
  }

  function tableData(header, rows) {
    const all = header.some(cell => cell) ? [header, ...rows] : rows;
    return csv(all.map(row => row.map(cell => cell.replace(/^\u2212(?=[0-9])/, "-"))));
  }

  function csv(rows) {
    return rows.map(row => row.map(quoted).join(",") + "\n").join("");
  }

  function quoted(cell) {
    return /[",\r\n]/.test(cell) ? '"' + cell.replaceAll('"', '""') + '"' : cell;
  }

  function ofTrace(each, layout) {
    const spatial = each.type.endsWith("3d");
    const axes = {};
    let number, ends;
    if (spatial) {
      const scene = each.scene || "scene";
      const panel = layout[scene] || {};
      number = scene.slice(5) || "1";
      for (const name of XYZ) axes[name] = panel[name + "axis"] || {};
      const domain = panel.domain || {};
      ends = [domain.x, domain.y];
    } else {
      number = (each.xaxis || "x").slice(1) || "1";
      for (const name of ["x", "y"]) axes[name] = axisOf(layout, each[name + "axis"] || name);
      ends = [axes.x.domain, axes.y.domain];
    }
    const common = {
      panel: number, panel_title: panelTitle(layout, ...ends), trace: line(each.name) || each.type,
    };
    for (const name in axes) common[name + "_axis"] = title(axes[name]);
    const marker = each.marker || {};
    const columns = {};
    for (const name of XYZ) columns[name] = cells(each[name]);
    let values = columns.z, bar = each;
    if (spatial || !MATRIX.includes(each.type)) {
      values = numbers(marker.color);
      bar = marker;
    }
    if (values !== null) {
      const shared = layout[bar.coloraxis || ""] || {};
      common.value_of = title(bar.colorbar || shared.colorbar || {});
    }
    columns.value = values;
    columns.size = numbers(marker.size);
    columns.base = numbers(each.base);
    columns.width = numbers(each.width);
    columns.text = cells("text" in each ? each.text : each.hovertext);
    for (const name of XYZ) {
      const error = each["error_" + name] || {};
      columns[name + "_plus"] = cells(error.array);
      columns[name + "_minus"] = cells(error.arrayminus);
    }
    const matrix = MATRIX.includes(each.type);
    const count = Math.max(...(matrix ? ["z"] : XYZ).map(name => (columns[name] || "").length));
    Object.assign(columns, hoversOf(cells(each.customdata), count));
    if (matrix) return ofMatrix(common, columns, axes);
    const places = XYZ.filter(name => columns[name] !== null);
    const rows = [];
    for (let at = 0; at < count; at++) {
      const row = {...common};
      for (const name in columns) row[name] = cellAt(columns[name], at);
      if (places.every(name => row[name] !== null)) rows.push(named(row, axes));
    }
    return rows;
  }

  function ofMatrix(common, columns, axes) {
    const across = columns.x || [], width = across.length;
    const rows = [];
    (columns.value || []).forEach((value, at) => {
      if (value === null) return;
      const row = {
        ...common, x: across[at % width], y: cellAt(columns.y, Math.floor(at / width)),
      };
      for (const name in columns) if (!XYZ.includes(name)) row[name] = cellAt(columns[name], at);
      rows.push(named(row, axes));
    });
    return rows;
  }

  function named(row, axes) {
    for (const name of ["x", "y"]) {
      const names = axes[name].ticktext, there = cells(axes[name].tickvals);
      if (names && names.length && there && there.includes(row[name])) {
        row[name + "_name"] = line(names[there.indexOf(row[name])]);
      }
    }
    return row;
  }

  function ofShapes(layout) {
    const rows = [];
    for (const shape of layout.shapes || []) {
      const names = ["x", "y"].filter(name => onAxis(shape[name + "ref"] || "paper"));
      if (!names.length) continue;
      const axes = {};
      for (const name of ["x", "y"]) {
        axes[name] = axisOf(layout, shape[name + "ref"].split(" ")[0]);
      }
      for (const end of ["0", "1"]) {
        const row = {
          panel: shape.xref.split(" ")[0].slice(1) || "1",
          panel_title: panelTitle(layout, axes.x.domain, axes.y.domain),
          trace: line(shape.name) || shape.type,
        };
        for (const name of names) {
          row[name + "_axis"] = title(axes[name]);
          row[name] = cell(shape[name + end]);
        }
        row.text = said((shape.label || {}).text);
        rows.push(row);
      }
    }
    return rows;
  }

  function ofNotes(layout) {
    const titles = domains(layout).map(ends => panelNote(layout, ...ends));
    const rows = [];
    (layout.annotations || []).forEach((note, at) => {
      if (titles.includes(at)) return;
      const names = ["x", "y"].filter(name => onAxis(note[name + "ref"] || name));
      const row = {
        panel: names.includes("x") ? (note.xref || "x").slice(1) || "1" : "", trace: "note",
      };
      for (const name of names) {
        row[name + "_axis"] = title(axisOf(layout, note[name + "ref"] || name));
        row[name] = cell(note[name]);
      }
      row.text = said(note.text);
      rows.push(row);
    });
    return rows;
  }

  function onAxis(reference) {
    return reference !== "paper" && !reference.endsWith("domain");
  }

  function axisOf(layout, name) {
    return layout[`${name[0]}axis${name.slice(1)}`] || {};
  }

  function title(of) {
    return line((of.title || {}).text);
  }

  function domains(layout) {
    const found = [];
    for (const name in layout) {
      if (/^scene[0-9]*$/.test(name)) {
        const domain = layout[name].domain || {};
        found.push([domain.x, domain.y]);
      } else if (/^xaxis[0-9]*$/.test(name)) {
        found.push([layout[name].domain, (layout["y" + name.slice(1)] || {}).domain]);
      }
    }
    return found;
  }

  function panelNote(layout, across, up) {
    if (!across || !up) return -1;
    return (layout.annotations || []).findIndex(
      note => note.xref === "paper" && note.yref === "paper" &&
        note.x === (across[0] + across[1]) / 2 && note.y === up[1]);
  }

  function panelTitle(layout, across, up) {
    const at = panelNote(layout, across, up);
    return at < 0 ? "" : line(layout.annotations[at].text);
  }

  function isArray(values) {
    return Array.isArray(values) || ArrayBuffer.isView(values);
  }

  // An array as texts, rows of a matrix one after the other; one value of all as a text.
  function cells(values) {
    if (values === undefined || values === null) return null;
    if (ArrayBuffer.isView(values)) {
      const single = values instanceof Float32Array;
      return Array.from(values, value => numberText(value, single));
    }
    if (Array.isArray(values)) {
      return values.flatMap(
        value => isArray(value) || (value && value.bdata) ? cells(value) : [cell(value)]);
    }
    if (typeof values === "object") {
      const bytes = Uint8Array.from(atob(values.bdata), letter => letter.charCodeAt(0));
      return cells(new ARRAYS[values.dtype](bytes.buffer));
    }
    return cell(values);
  }

  function numbers(values) {
    const found = cells(values);
    if (!Array.isArray(found)) return null;
    const isText = Array.isArray(values) && values.some(value => typeof value === "string");
    return isText ? null : found;
  }

  function hoversOf(found, count) {
    const width = count && Array.isArray(found) ? Math.floor(found.length / count) : 0;
    const columns = {};
    for (let at = 0; at < width; at++) {
      columns[`hover_${at + 1}`] = found.filter((_, index) => index % width === at);
    }
    return columns;
  }

  function cellAt(found, at) {
    if (!Array.isArray(found)) return found;
    return at < found.length ? found[at] : null;
  }

  function cell(value) {
    if (value === undefined || value === null) return null;
    return typeof value === "string" ? said(value) : numberText(Number(value), false);
  }

  // The fewest digits that are this number again, in the precision that it has.
  function numberText(value, single) {
    if (!Number.isFinite(value)) return null;
    if (single) {
      for (let digits = 1; digits <= 9; digits++) {
        const rounded = Number(value.toPrecision(digits));
        if (digits === 9 || Math.fround(rounded) === value) {
          value = rounded;
          break;
        }
      }
    }
    return String(value);
  }

  function said(text) {
    return plain(text, "; ");
  }

  function line(text) {
    return plain(text, " ");
  }

  function plain(text, end) {
    return (text || "").replaceAll("<br>", end).replaceAll("&lt;", "<").replaceAll("&gt;", ">")
      .replaceAll("&amp;", "&");
  }

  return { figureData, tableData };
})();
